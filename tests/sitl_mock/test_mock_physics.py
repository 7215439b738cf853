"""The motion model against hand calculations, its own limits and the world's energy model."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, nan, radians, tan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from policy.world.energy import propulsion_power_w
from sitl_mock.physics.fleet import STEP_S, TICK_S, Air, Fleet, course_rad, wind_ne
from sitl_mock.physics.vehicle import ARDUQUAD, M600, PARAMETERS, VehicleType, lean_transition, parameter_column


def airborne(kind: VehicleType = M600, wind: tuple[float, float] = (0.0, 0.0)) -> Fleet:
    fleet = Fleet([kind], Air(wind))
    fleet.place(np.array([[0.0, 0.0, -100.0]]), np.zeros((1, 3)))
    return fleet


def command(fleet: Fleet, north: float, east: float, down: float = 0.0) -> None:
    fleet.command[:] = [north, east, down, nan, 1.0]


def test_battery_of_the_paper_holds_359640_j() -> None:
    assert M600.battery_j == pytest.approx(4.5 * 3600 * 22.2)


def test_parameter_columns_follow_their_names() -> None:
    column = dict(zip(PARAMETERS, parameter_column(ARDUQUAD, STEP_S), strict=True))
    assert column["speed"] == ARDUQUAD.max_speed_mps
    assert column["yaw_rate"] == ARDUQUAD.yaw_rate_radps
    assert column["linear"] == pytest.approx(2.5**2 / 5.0)


@given(st.floats(0.5, 40.0), st.floats(0.05, 3.0), st.floats(-2, 2), st.floats(-5, 5))
def test_lean_step_is_exact(frequency: float, damping: float, error: float, rate: float) -> None:
    """Against ten thousand small steps of the same equation."""
    p11, p12, p21, p22 = lean_transition(frequency, damping, STEP_S)
    x, v = np.array(error), np.array(rate)
    small = STEP_S / 10_000
    for _ in range(10_000):  # midpoint rule
        acc = -(frequency**2) * x - 2 * damping * frequency * v
        xm, vm = x + 0.5 * small * v, v + 0.5 * small * acc
        x, v = x + small * vm, v + small * (-(frequency**2) * xm - 2 * damping * frequency * vm)
    assert p11 * error + p12 * rate == pytest.approx(float(x), abs=1e-4)
    assert p21 * error + p22 * rate == pytest.approx(float(v), abs=1e-3)


def test_wind_comes_from_where_it_is_said_to() -> None:
    assert wind_ne(6.0, 270.0) == pytest.approx((0.0, 6.0), abs=1e-12)  # from the west: the air moves east
    assert course_rad((0.0, -1.0)) == pytest.approx(radians(270.0))


def test_commanded_velocity_is_reached_and_kept() -> None:
    fleet = airborne()
    command(fleet, 12.0, -9.0)
    fleet.advance(round(20.0 / TICK_S))
    assert fleet.vel_ned_mps[0] == pytest.approx([12.0, -9.0, 0.0], abs=0.05)


def test_constant_wind_is_held_against() -> None:
    fleet = airborne(wind=wind_ne(8.0, 0.0))
    command(fleet, 0.0, 0.0)
    fleet.advance(round(30.0 / TICK_S))
    assert fleet.vel_ned_mps[0] == pytest.approx([0.0, 0.0, 0.0], abs=0.02)
    _, pitch, _ = fleet.attitude_rad(0)
    held = tan(pitch) * 9.80665  # nose down into the wind: drag at 8 m/s
    assert held == pytest.approx(-M600.drag_quadratic_1pm * 64.0, rel=0.02)


def test_lean_limits_the_top_speed() -> None:
    """At full lean drag balances g tan(lean): v^2 = g tan(lean) / k, by hand 12.1 m/s here."""
    kind = replace(M600, drag_quadratic_1pm=0.02, max_lean_rad=radians(16.6))
    fleet = airborne(kind)
    command(fleet, 18.0, 0.0)
    fleet.advance(round(60.0 / TICK_S))
    expected = (9.80665 * tan(radians(16.6)) / 0.02) ** 0.5
    assert fleet.vel_ned_mps[0, 0] == pytest.approx(expected, rel=0.01)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.floats(-30, 30), st.floats(-30, 30), st.floats(-9, 9)), min_size=1, max_size=6))
def test_limits_hold_whatever_is_commanded(commands: list[tuple[float, float, float]]) -> None:
    """Acceleration stays within the lean limit plus drag, speed within the limit plus a small overshoot."""
    fleet = airborne()
    fleet.place(np.array([[0.0, 0.0, -1000.0]]), np.zeros((1, 3)))
    before = fleet.vel_ned_mps[0].copy()
    for north, east, down in commands:
        command(fleet, north, east, down)
        for _ in range(150):
            fleet.advance(1)
            now = fleet.vel_ned_mps[0].copy()
            gained = hypot(*(now - before)[:2]) / TICK_S
            assert gained <= M600.max_thrust_accel_mps2 + 1.5
            assert hypot(*now[:2]) <= M600.max_speed_mps + 0.7
            assert -M600.climb_mps - 0.5 <= now[2] <= M600.descent_mps + 0.5
            before = now


def test_energy_is_the_worlds() -> None:
    fleet = airborne()
    command(fleet, 0.0, 0.0)
    fleet.advance(500)
    assert float(fleet.used_j[0]) == pytest.approx(10.0 * float(propulsion_power_w(np.float64(0.0))), rel=1e-9)
    fleet.place(np.array([[0.0, 0.0, -50.0]]), np.array([[18.0, 0.0, 0.0]]))
    command(fleet, 18.0, 0.0)
    fleet.advance(5000)
    assert float(fleet.power_w[0]) == pytest.approx(float(propulsion_power_w(np.float64(18.0))), rel=1e-3)


def test_ground_carries_and_motors_off_falls() -> None:
    fleet = Fleet([M600])
    command(fleet, 5.0, 0.0)
    fleet.advance(100)
    assert fleet.pos_ned_m[0] == pytest.approx([0.0, 0.0, 0.0])
    fleet.place(np.array([[0.0, 0.0, -20.0]]), np.zeros((1, 3)))
    fleet.command[0, 4] = 0.0
    fleet.advance(50)
    assert float(fleet.vel_ned_mps[0, 2]) == pytest.approx(9.8, rel=0.05)  # one second of free fall
    fleet.advance(200)
    assert float(fleet.pos_ned_m[0, 2]) == 0.0
    assert fleet.vel_ned_mps[0] == pytest.approx([0.0, 0.0, 0.0])


def test_runs_repeat_bit_by_bit() -> None:
    runs = []
    for _ in range(2):
        fleet = airborne(wind=(3.0, -2.0))
        command(fleet, 17.0, 4.0, -1.0)
        fleet.advance(1234)
        runs.append(fleet.pos_ned_m.tobytes())
    assert runs[0] == runs[1]
