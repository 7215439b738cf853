"""The propulsion model against hand calculation and the paper's energy ratios."""

import math

import numpy as np
import pytest

from policy.world.energy import battery_energy_j, propulsion_power_w, used_energy_j


def test_hover_and_full_speed_by_hand() -> None:
    assert propulsion_power_w(np.asarray(0.0)) == pytest.approx(79.8563 + 88.6279)
    v = 18.0
    ratio = v**4 / (4 * 4.03**4)
    by_hand = (
        79.8563 * (1 + 3 * v**2 / 120**2)
        + 88.6279 * math.sqrt(math.sqrt(1 + ratio) - v**2 / (2 * 4.03**2))
        + 0.5 * 0.0185 * v**3
    )
    assert propulsion_power_w(np.asarray(v)) == pytest.approx(by_hand, rel=1e-9)


@pytest.mark.parametrize(("speed_mps", "ratio"), [(18.0, 0.796), (0.0, 0.843), (10.2, 0.631)])
def test_energy_ratio_of_a_campaign(speed_mps: float, ratio: float) -> None:
    used = 120 * used_energy_j(np.full(31, speed_mps), 15.0)
    assert used / battery_energy_j(4500.0, 22.2) == pytest.approx(ratio, abs=5e-4)


def test_battery_by_hand() -> None:
    assert battery_energy_j(4500.0, 22.2) == pytest.approx(359_640.0)


def test_least_power_is_near_ten_metres_per_second() -> None:
    speeds = np.linspace(0.0, 18.0, 1801)
    assert speeds[np.argmin(propulsion_power_w(speeds))] == pytest.approx(10.2, abs=0.1)


def test_trapezoid_of_a_ramp_is_near_the_fine_integral() -> None:
    coarse = used_energy_j(np.linspace(0.0, 18.0, 31), 15.0)
    fine = used_energy_j(np.linspace(0.0, 18.0, 15_001), 15.0)
    assert coarse == pytest.approx(fine, rel=1e-3)
