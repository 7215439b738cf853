"""Motion within a slot: the paper's limit, a numerical integration as second opinion, composition of slots."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policy.world.arrays import FloatArray
from policy.world.motion import (
    change_time_s,
    displacement_m,
    end_velocity_mps,
    slot_motion,
    slot_path_m,
    stopping_point_m,
    velocity_mps,
)

velocities = st.tuples(st.floats(-18.0, 18.0), st.floats(-18.0, 18.0)).map(np.asarray)
accels = st.floats(0.5, 20.0)


def integrate(start: FloatArray, goal: FloatArray, accel: float, time_s: float, steps: int = 20_000) -> FloatArray:
    """Forward Euler at a fine step: turn toward the goal at ``accel``."""
    velocity, position, dt = start.astype(float).copy(), np.zeros(2), time_s / steps
    for _ in range(steps):
        gap = goal - velocity
        size = math.hypot(*gap)
        velocity = goal.astype(float).copy() if size <= accel * dt else velocity + gap / size * accel * dt
        position = position + velocity * dt
    return position


def test_infinite_acceleration_is_the_papers_motion() -> None:
    way = displacement_m(np.asarray([5.0, 5.0]), np.asarray([18.0, 0.0]), math.inf, np.asarray(15.0))
    assert way.tolist() == [270.0, 0.0]


def test_reversal_by_hand() -> None:
    # 36 m/s at 4.5 m/s^2 takes 8 s and gains no ground; 7 s remain at 18 m/s.
    start, goal = np.asarray([0.0, 18.0]), np.asarray([0.0, -18.0])
    assert change_time_s(start, goal, 4.5) == pytest.approx(8.0)
    assert displacement_m(start, goal, 4.5, np.asarray(15.0)) == pytest.approx([0.0, -126.0])


@pytest.mark.parametrize("accel", [1.0, 2.5, 4.5, 12.0])
def test_against_numerical_integration(accel: float) -> None:
    start, goal = np.asarray([12.0, -9.0]), np.asarray([-3.0, 17.0])
    expected = integrate(start, goal, accel, 15.0)
    assert displacement_m(start, goal, accel, np.asarray(15.0)) == pytest.approx(expected, abs=0.05)


@given(velocities, velocities, accels, st.floats(0.1, 14.9))
def test_two_parts_make_the_whole(start: FloatArray, goal: FloatArray, accel: float, split_s: float) -> None:
    first = displacement_m(start, goal, accel, np.asarray(split_s))
    between = velocity_mps(start, goal, accel, np.asarray(split_s))
    second = displacement_m(between, goal, accel, np.asarray(15.0 - split_s))
    assert first + second == pytest.approx(displacement_m(start, goal, accel, np.asarray(15.0)), abs=1e-6)


@given(velocities, velocities, accels)
def test_paths_begin_and_end_where_they_should(start: FloatArray, goal: FloatArray, accel: float) -> None:
    pos = np.asarray([100.0, 200.0])
    path, speeds = slot_path_m(pos, start, goal, accel, 15.0)
    assert path.shape == (31, 2)
    assert path[0] == pytest.approx(pos)
    assert path[-1] - pos == pytest.approx(displacement_m(start, goal, accel, np.asarray(15.0)))
    assert np.all(speeds <= max(np.linalg.norm(start), np.linalg.norm(goal)) + 1e-9)


def test_stopping_by_hand() -> None:
    # 18 m/s at 4.5 m/s^2: 36 m, and 18 m more for a second's reaction.
    stop = stopping_point_m(np.zeros(2), np.asarray([18.0, 0.0]), 4.5, reaction_s=1.0)
    assert stop == pytest.approx([54.0, 0.0])
    assert stopping_point_m(np.zeros(2), np.asarray([18.0, 0.0]), math.inf) == pytest.approx([0.0, 0.0])


def test_a_pre_turn_by_hand() -> None:
    # North at 18 m/s, left at rest: braking at 4.5 m/s^2 takes the last 4 s and costs 36 m of the 270.
    north, rest = np.asarray([0.0, 18.0]), np.zeros(2)
    way, vel = slot_motion(north, north, rest, 4.5, 15.0, np.asarray([11.0, 13.0, 15.0]))
    assert way == pytest.approx(np.asarray([[0.0, 198.0], [0.0, 225.0], [0.0, 234.0]]))
    assert vel == pytest.approx(np.asarray([[0.0, 18.0], [0.0, 9.0], [0.0, 0.0]]))


@given(velocities, velocities, velocities, accels)
def test_a_slot_with_a_pre_turn_against_numerical_integration(
    start: FloatArray, cruise: FloatArray, end: FloatArray, accel: float
) -> None:
    way, vel = slot_motion(start, cruise, end, accel, 15.0, np.asarray(15.0))
    reached_s = math.dist(start, cruise) / accel
    begin_s = min(max(reached_s, 15.0 - math.dist(cruise, end) / accel), 15.0)
    first = integrate(start, cruise, accel, begin_s, steps=4000)
    there = velocity_mps(start, cruise, accel, np.asarray(begin_s))
    second = integrate(there, end, accel, 15.0 - begin_s, steps=4000) if begin_s < 15.0 else np.zeros(2)
    assert way == pytest.approx(first + second, abs=0.3)
    if reached_s + math.dist(cruise, end) / accel <= 15.0:
        assert vel == pytest.approx(end, abs=1e-6)


@given(velocities, velocities, accels)
def test_leaving_as_commanded_is_no_pre_turn(start: FloatArray, goal: FloatArray, accel: float) -> None:
    plain, same = (slot_path_m(np.zeros(2), start, goal, accel, 15.0, end) for end in (None, goal))
    assert plain[0] == pytest.approx(same[0])
    assert plain[1] == pytest.approx(same[1])
    ends = [end_velocity_mps(start, goal, accel, 15.0, end) for end in (None, goal)]
    assert ends[0] == pytest.approx(ends[1])


def test_the_papers_motion_has_no_use_for_a_pre_turn() -> None:
    way, vel = slot_motion(
        np.zeros(2), np.asarray([18.0, 0.0]), np.asarray([0.0, 18.0]), math.inf, 15.0, np.asarray(15.0)
    )
    assert way.tolist() == [270.0, 0.0]
    assert vel.tolist() == [18.0, 0.0]
