"""Motion within a slot: the paper's limit, a numerical integration as second opinion, composition of slots."""

import math

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from policy.world.arrays import FloatArray
from policy.world.motion import (
    change_time_s,
    end_velocity_mps,
    make_turn,
    slot_motion,
    slot_path_m,
    stopping_point_m,
    turn_motion,
)

velocities = st.tuples(st.floats(-18.0, 18.0), st.floats(-18.0, 18.0)).map(np.asarray)
accels = st.floats(0.5, 20.0)


def derived(vel_mps: FloatArray, slot_s: float = 15.0) -> tuple[FloatArray, float]:
    """Velocities [K, 2] at even times of a slot, as a second opinion of it: (places [K, 2], greatest acceleration)."""
    step_s = slot_s / (len(vel_mps) - 1)
    ways = np.cumsum(0.5 * step_s * (vel_mps[1:] + vel_mps[:-1]), axis=0)
    accel = np.linalg.norm(np.diff(vel_mps, axis=0), axis=-1) / step_s
    return np.concatenate((np.zeros((1, 2)), ways)), float(accel.max())


def test_infinite_acceleration_is_the_papers_motion() -> None:
    way, _ = slot_motion(np.asarray([5.0, 5.0]), np.asarray([18.0, 0.0]), None, math.inf, 15.0, np.asarray(15.0))
    assert way.tolist() == [270.0, 0.0]


def test_reversal_by_hand() -> None:
    # 36 m/s at 4.5 m/s^2 takes 8 s and gains no ground; 7 s remain at 18 m/s.
    start, goal = np.asarray([0.0, 18.0]), np.asarray([0.0, -18.0])
    assert change_time_s(start, goal, 4.5) == pytest.approx(8.0)
    way, _ = slot_motion(start, goal, None, 4.5, 15.0, np.asarray(15.0))
    assert way == pytest.approx([0.0, -126.0], abs=1e-5)


def test_a_right_angle_by_hand() -> None:
    # At 18 m/s and 4.5 m/s^2 a quarter of a circle of 18^2 / 4.5 = 72 m, in pi / 2 * 4 s, at full speed.
    east, north = np.asarray([18.0, 0.0]), np.asarray([0.0, 18.0])
    way, vel = slot_motion(east, north, None, 4.5, 15.0, np.asarray([math.pi, 2.0 * math.pi, 10.0]))
    half = 72.0 * math.sin(math.pi / 4.0)
    assert way == pytest.approx(
        np.asarray([[half, 72.0 - half], [72.0, 72.0], [72.0, 72.0 + 18.0 * (10 - 2 * math.pi)]])
    )
    assert vel == pytest.approx(np.asarray([[half / 4.0, half / 4.0], north, north]), abs=1e-9)


@given(velocities, velocities, accels)
def test_single_precision_is_good_to_a_decimetre(start: FloatArray, goal: FloatArray, accel: float) -> None:
    singly = [torch.asarray(value, dtype=torch.float32) for value in (start, goal)]
    way, vel = slot_motion(*singly, None, accel, 15.0, torch.linspace(0.0, 15.0, 16))
    fine_way, fine_vel = slot_motion(start, goal, None, accel, 15.0, np.linspace(0.0, 15.0, 16))
    assert way.dtype == torch.float32
    if (np.pi - abs(math.remainder(math.atan2(*start) - math.atan2(*goal), 2 * math.pi))) > 1e-4:  # else left or right
        assert way.numpy() == pytest.approx(fine_way, abs=0.1)
        assert vel.numpy() == pytest.approx(fine_vel, abs=0.01)


def test_what_the_slot_leaves_no_time_for_is_flown_straighter() -> None:
    # A right angle takes 14.1 s as a circle at 2 m/s^2 and 12.7 s straight; 12.7 s is all that is left here.
    east, north = np.asarray([18.0, 0.0]), np.asarray([0.0, 18.0])
    straight_s = 18.0 * math.sqrt(2.0) / 2.0
    turn = make_turn(east, north, 2.0, straight_s)
    assert turn.time_s == pytest.approx(straight_s)
    way, vel = turn_motion(turn, np.asarray([straight_s / 2.0, straight_s]))
    assert vel == pytest.approx(np.asarray([[9.0, 9.0], [0.0, 18.0]]), abs=1e-4)
    assert way[1] == pytest.approx(straight_s * np.asarray([9.0, 9.0]), abs=1e-3)
    assert straight_s < make_turn(east, north, 2.0, 13.5).time_s <= 13.5
    assert make_turn(east, north, 2.0, 15.0).time_s == pytest.approx(math.pi / 2.0 * 9.0)


@given(velocities, velocities, st.one_of(st.none(), velocities), accels)
def test_a_slot_against_numerical_integration(
    start: FloatArray, cruise: FloatArray, end: FloatArray | None, accel: float
) -> None:
    way, vel = slot_motion(start, cruise, end, accel, 15.0, np.linspace(0.0, 15.0, 3001))
    expected, most = derived(vel)
    assert way == pytest.approx(expected, abs=0.02)
    assert most <= accel * (1.0 + 1e-4)
    bounds = [np.linalg.norm(v) for v in (start, cruise, end) if v is not None]
    assert np.linalg.norm(vel, axis=-1).max() <= max(bounds) + 1e-6
    last = cruise if end is None else end
    if (math.dist(start, cruise) + math.dist(cruise, last)) / accel <= 15.0:
        assert vel[-1] == pytest.approx(last, abs=1e-6)


@given(st.floats(0.0, 2.0 * math.pi), st.floats(-2.8, 2.8), st.floats(1.0, 18.0), accels, st.floats(0.1, 14.9))
def test_two_parts_of_a_coordinated_turn_make_the_whole(
    heading: float, turn: float, speed: float, accel: float, split_s: float
) -> None:
    start, goal = (speed * np.asarray([math.sin(at), math.cos(at)]) for at in (heading, heading + turn))
    first, between = turn_motion(make_turn(start, goal, accel, math.inf), np.asarray(split_s))
    second, _ = turn_motion(make_turn(between, goal, accel, math.inf), np.asarray(15.0 - split_s))
    whole, _ = turn_motion(make_turn(start, goal, accel, math.inf), np.asarray(15.0))
    assert np.linalg.norm(between) == pytest.approx(speed)
    assert first + second == pytest.approx(whole, abs=1e-3)


@given(velocities, velocities, accels)
def test_a_turn_to_the_left_mirrors_one_to_the_right_and_is_the_same_backwards(
    start: FloatArray, goal: FloatArray, accel: float
) -> None:
    mirror, times_s = np.asarray([-1.0, 1.0]), np.linspace(0.0, 1.0, 7)
    turn, mirrored, back = (
        make_turn(*ends, accel, math.inf) for ends in ((start, goal), (start * mirror, goal * mirror), (-goal, -start))
    )
    there, as_mirrored, as_back = (turn_motion(t, times_s * t.time_s)[0] for t in (turn, mirrored, back))
    assert as_mirrored * mirror == pytest.approx(there, abs=1e-3)
    assert as_back == pytest.approx(there[::-1] - there[-1], abs=1e-3)


@given(velocities, velocities, accels)
def test_paths_begin_and_end_where_they_should(start: FloatArray, goal: FloatArray, accel: float) -> None:
    pos = np.asarray([100.0, 200.0])
    path, speeds = slot_path_m(pos, start, goal, accel, 15.0)
    assert path.shape == (31, 2)
    assert path[0] == pytest.approx(pos)
    way, vel = slot_motion(start, goal, None, accel, 15.0, np.asarray(15.0))
    assert path[-1] - pos == pytest.approx(way)
    assert speeds[-1] == pytest.approx(np.linalg.norm(vel))
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
    assert way == pytest.approx(np.asarray([[0.0, 198.0], [0.0, 225.0], [0.0, 234.0]]), abs=1e-5)
    assert vel == pytest.approx(np.asarray([[0.0, 18.0], [0.0, 9.0], [0.0, 0.0]]), abs=1e-5)


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
