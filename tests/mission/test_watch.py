"""Drop-out rules, one row a case."""

import numpy as np
import pytest

from gcs.mission.watch import Fate, battery_low, control_lost, return_energy_j
from gcs.ports import FlightMode, UavTrack, VehicleStatus
from policy.world.scenario import Area, Scenario

FLYING = {"armed": True, "mode": FlightMode.GUIDED, "heartbeat_s": 100.0}
SCENARIO = Scenario(Area((40.0, -86.0), (1000.0, 1000.0)), np.zeros((1, 2)), np.ones(3))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, None),
        ({"heartbeat_s": 94.9}, "link is lost"),
        ({"heartbeat_s": None}, "link is lost"),
        ({"armed": False}, "disarmed"),
        ({"mode": FlightMode.PILOT, "mode_name": "POSCTL"}, "POSCTL"),
        ({"mode": FlightMode.RETURN}, "return"),
        ({"heartbeat_s": 95.1}, None),
    ],
)
def test_control_lost(changes: dict[str, object], words: str | None) -> None:
    dropout = control_lost(VehicleStatus(1, **{**FLYING, **changes}), 100.0)  # type: ignore[arg-type]
    if words is None:
        assert dropout is None
    else:
        assert dropout is not None
        assert dropout.fate is Fate.RELEASE
        assert words in dropout.reason


def test_a_vehicle_never_heard_is_lost() -> None:
    assert control_lost(None, 0.0) is not None


@pytest.mark.parametrize(
    ("distance_m", "fraction", "home"),
    [(0.0, 0.5, False), (0.0, 0.05, True), (2000.0, 0.14, True), (2000.0, 0.25, False)],
)
def test_battery_counts_the_way_home(distance_m: float, fraction: float, home: bool) -> None:
    track = UavTrack(1, distance_m, 0.0, 120.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    dropout = battery_low(VehicleStatus(1, battery_fraction=fraction), track, (0.0, 0.0), SCENARIO, 0.03)
    assert (dropout is not None) is home


def test_an_unknown_battery_is_not_judged() -> None:
    track = UavTrack(1, 0.0, 0.0, 120.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert battery_low(VehicleStatus(1), track, (0.0, 0.0), SCENARIO, 0.03) is None


def test_energy_home_by_hand() -> None:
    # 1000 m at 10 m/s and 126.2 W, 120 m down at 1.5 m/s hovering at 168.5 W (Section III of the paper)
    assert return_energy_j(1000.0, 120.0, 0.0) == pytest.approx(100.0 * 126.2 + 80.0 * 168.5, rel=0.002)


def test_wind_makes_the_way_home_dearer() -> None:
    assert return_energy_j(1000.0, 120.0, 10.0) > return_energy_j(1000.0, 120.0) > return_energy_j(1000.0, 0.0)
