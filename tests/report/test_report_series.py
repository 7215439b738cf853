import numpy as np
import pytest

from gcs.ports import SlotRecord, UavSlot, UserSlot
from gcs.report import ReportData
from gcs.report.series import decision_percentiles_ms, series, uav_totals, user_totals
from policy.world.metrics import Metrics
from policy.world.scenario import Area, Scenario


@pytest.fixture
def by_hand() -> ReportData:
    scenario = Scenario(Area((0.0, 0.0), (1000.0, 1000.0)), np.zeros((1, 2)), np.full(2, 0.02), slots=2)

    def record(slot: int, east_m: float, ages: tuple[float, float], metrics: Metrics | None) -> SlotRecord:
        users = tuple(UserSlot(f"u{i}", 0.0, 0.0, age, 0.3 * (age - 1.0), age == 1.0) for i, age in enumerate(ages))
        uav = UavSlot(7, east_m, 0.0, 90.0, 10.0, 1000.0 * slot, active=slot < 2)
        return SlotRecord(slot, 15.0 * slot, (uav,), users, metrics, 2.0 * slot or None)

    return ReportData(
        "hand",
        "random",
        scenario,
        (
            record(0, 0.0, (1.0, 1.0), None),
            record(1, 150.0, (1.0, 2.0), Metrics(1.5, 0.5, 0.5, 0.1, 1.5)),
            record(2, 300.0, (2.0, 3.0), Metrics(2.0, 0.4, 0.25, 0.2, 2.5)),
        ),
    )


def test_curves_by_hand(by_hand: ReportData):
    curves = series(by_hand)
    assert curves.slot == (1, 2)
    assert curves.mean_aoi_slots == (1.5, 2.5)
    assert curves.max_aoi_slots == (2.0, 3.0)
    assert curves.served == (0.5, 0.0)
    assert curves.coverage_so_far == (0.5, 0.25)
    assert curves.decision_ms == (2.0, 4.0)


def test_totals_by_hand(by_hand: ReportData):
    (uav,) = uav_totals(by_hand)
    assert (uav.system_id, uav.distance_m, uav.mean_speed_mps, uav.slots_active) == (7, 300.0, 10.0, 1)
    assert uav.energy_share == pytest.approx(2000.0 / 359_640.0)
    longest, shortest = user_totals(by_hand)
    assert (longest.user_id, longest.mean_aoi_slots, longest.max_aoi_slots, longest.served_share) == (
        "u1",
        2.5,
        3.0,
        0.0,
    )
    assert (shortest.user_id, shortest.served_share) == ("u0", 0.5)


def test_decision_times_that_are_not_known_are_left_out():
    assert decision_percentiles_ms([None, 1.0, 3.0, None]) == pytest.approx((2.0, 2.98))
    assert decision_percentiles_ms([None]) is None
