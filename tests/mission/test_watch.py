"""Drop-out rules, one row a case."""

import numpy as np
import pytest

from gcs.mission.watch import Fate, battery_low, motor_failed, position_lost, return_energy_j
from gcs.ports import UavTrack, VehicleStatus
from policy.world.scenario import Area, Scenario

SCENARIO = Scenario(Area((40.0, -86.0), (1000.0, 1000.0)), np.zeros((1, 2)), np.ones(3))


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


def test_a_wind_that_the_vehicle_reports_counts_when_it_is_harder_than_the_assumed_one() -> None:
    track = UavTrack(1, 1500.0, 0.0, 120.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    fate = [
        battery_low(VehicleStatus(1, battery_fraction=0.2, wind_mps=wind_mps), track, (0.0, 0.0), SCENARIO, 0.03)
        for wind_mps in (None, 2.0, 14.0)
    ]
    assert fate[0] is None
    assert fate[1] is None
    assert fate[2] is not None
    assert "14 m/s of wind" in fate[2].reason


def test_a_wind_near_the_top_speed_makes_the_way_home_slow_by_hand() -> None:
    # 18 - 14 = 4 m/s over ground at 18 m/s through the air (242 W by Section III): 1000 m take 250 s, not 100
    slow = return_energy_j(1000.0, 0.0, 14.0, 18.0)
    assert slow / return_energy_j(1000.0, 0.0, 8.0, 18.0) == pytest.approx(2.5, rel=0.001)


def test_a_failed_motor_sends_home_and_bad_satellites_stop() -> None:
    assert motor_failed(VehicleStatus(1)) is None
    failed = motor_failed(VehicleStatus(1, motors_ok=False))
    assert failed is not None
    assert failed.fate is Fate.GO_HOME
    assert not position_lost(VehicleStatus(1, position_ready=True))
    assert "satellite" in position_lost(VehicleStatus(1, position_ready=True, satellites_ok=False))
    assert "own position" in position_lost(VehicleStatus(1, position_ready=False))
