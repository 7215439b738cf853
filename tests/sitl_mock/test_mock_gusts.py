"""Dryden gusts: their statistics, and that chance is the vehicle's own."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from sitl_mock.physics import layout
from sitl_mock.physics.fleet import STEP_TICKS, Air, Fleet
from sitl_mock.physics.gusts import normal
from sitl_mock.physics.vehicle import ARDUQUAD, M600, VehicleType

W20_MPS = 10.0
HEIGHT_M = 120.0


def _hovering(count: int, seed: int = 0, kind: VehicleType = M600) -> Fleet:
    fleet = Fleet([kind] * count, Air((0.0, 5.0), W20_MPS, seed))
    fleet.place(np.tile([0.0, 0.0, -HEIGHT_M], (count, 1)), np.zeros((count, 3)))
    fleet.command[:, layout.CMD_MOTORS] = 1.0
    return fleet


def test_strength_is_that_of_the_standard() -> None:
    """MIL-F-8785C: sigma_u = 0.1 W20 / (0.177 + 0.000823 h)^0.4, h in feet; here 1.38 m/s along, by hand."""
    fleet = _hovering(400)
    feet = HEIGHT_M / 0.3048
    sigma = 0.1 * W20_MPS / (0.177 + 0.000823 * feet) ** 0.4
    fleet.advance(60 * 50)
    along = []
    for _ in range(40):
        fleet.advance(STEP_TICKS * 100)
        along.append(fleet._state[layout.GUST].copy())
    assert float(np.std(along)) == pytest.approx(sigma, rel=0.05)
    assert float(np.mean(along)) == pytest.approx(0.0, abs=0.1)


def test_the_vehicle_is_shaken_but_holds_its_velocity_on_average() -> None:
    fleet = _hovering(50, kind=ARDUQUAD)  # its drag is known from logs
    speeds = []
    for _ in range(300):
        fleet.advance(STEP_TICKS)
        speeds.append(fleet.vel_ned_mps.copy())
    assert 0.02 < float(np.std(speeds)) < 1.0
    assert float(np.abs(np.mean(speeds, axis=0)).mean()) < 0.2


def test_chance_does_not_depend_on_company_or_on_the_size_of_calls() -> None:
    many, few = _hovering(130, seed=9), _hovering(3, seed=9)
    many.advance(1000)
    for _ in range(1000):
        few.advance(1)
    np.testing.assert_allclose(many.pos_ned_m[:3], few.pos_ned_m, atol=1e-9)
    assert hypot(*(many.pos_ned_m[0] - many.pos_ned_m[1])[:2]) > 1e-3
    other = _hovering(3, seed=10)
    other.advance(1000)
    assert not np.allclose(other.pos_ned_m, few.pos_ned_m)


def test_normals_are_normal() -> None:
    values = np.array([normal(1, vehicle, step, 0) for vehicle in range(40) for step in range(500)])
    assert float(values.mean()) == pytest.approx(0.0, abs=0.03)
    assert float(values.std()) == pytest.approx(1.0, abs=0.03)
    assert float((values**3).mean()) == pytest.approx(0.0, abs=0.1)
