"""Polished plans: never dearer, always flyable, and priced as the world prices them."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from policy.search.kernel import _turn as kernel_turn
from policy.search.kernel import search
from policy.search.moves import make_moves
from policy.search.planner import make_plan
from policy.search.polish import (
    SHIFT_M,
    Legs,
    _in_play,
    cruise,
    joint_price,
    keep_up,
    make_desk,
    polish,
    turn,
    turn_way,
    ways_j,
)
from policy.search.problem import Problem, make_problem
from policy.search.settings import HALF_TURNS_RAD, SearchSettings
from policy.world.airspace import legal_moves
from policy.world.geometry import pairwise_distance_m
from policy.world.motion import make_turn, slot_motion, turn_motion
from policy.world.scenario import Area, Objective, Obstacle, Scenario
from policy.world.state import JointAction, WorldState, initial_state
from policy.world.transition import step

COARSE = SearchSettings(horizon_slots=5, beam=6, num_headings=8, rebuilds=0, rounds=1)
POLISHED = replace(COARSE, polish_sweeps=4)


def scenario(num_uavs: int, obstacles: tuple[Obstacle, ...] = (), objective: Objective | None = None) -> Scenario:
    area = Area((40.0, -86.0), (1200.0, 1100.0), obstacles)
    launch = np.tile([[600.0, 600.0]], (num_uavs, 1))
    return Scenario(area, launch, np.full(14, 0.02), objective=objective or Objective())


def problem_of(place: Scenario, seed: int, how: SearchSettings, blur_m: float = 0.0, slot: int = 0) -> Problem:
    rng = np.random.default_rng(seed)
    users = rng.uniform(0.0, 1.0, (place.num_users, 2)) * np.asarray(place.area.size_m)
    state = replace(
        initial_state(place, users),
        slot=slot,
        user_aoi_slots=rng.integers(1, 20, place.num_users).astype(np.float64),
    )
    blur = np.full((how.horizon_slots, place.num_users), blur_m)
    return make_problem(place, make_moves(place, how), state, how, None, blur)


def flown(problem: Problem, path_m: np.ndarray) -> tuple[float, WorldState]:
    """A polished plan by the world's own rules: its price without what comes after, infinite where not legal."""
    place, state, total = problem.scenario, problem.state, 0.0
    for depth in range(path_m.shape[1]):
        vel = (path_m[:, depth] - state.uav_pos_enu_m) / place.slot_s
        if not np.all(legal_moves(state.uav_pos_enu_m, state.uav_vel_enu_mps, vel, place)):
            return math.inf, state
        action = JointAction(np.arctan2(vel[:, 0], vel[:, 1]), np.hypot(vel[:, 0], vel[:, 1]))
        state, outcome = step(place, state, action, state.user_pos_enu_m)
        left = problem.settings.last_weight if state.slot == place.slots else 0.0
        slot = (1.0 + left) * np.mean(state.user_aoi_slots) - problem.prices.cover * np.mean(outcome.served)
        total += float(slot + problem.prices.energy * np.sum(outcome.energy_j))
    return total, state


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    num_uavs=st.integers(1, 3),
    thrift=st.sampled_from([0.0, 0.05]),
    slots_left=st.sampled_from([4, 120]),
)
def test_a_polished_plan_is_flyable_and_priced_by_the_world(
    seed: int, num_uavs: int, thrift: float, slots_left: int
) -> None:
    place = scenario(num_uavs, objective=Objective(c_cover=1.0, c_energy=5.0))
    how = replace(POLISHED, thrift=thrift, last_weight=2.0)
    problem = problem_of(place, seed, how, slot=place.slots - slots_left)
    plan = make_plan(problem)
    cost, end = flown(problem, plan.path_enu_m)
    away_m = pairwise_distance_m(end.uav_pos_enu_m, end.user_pos_enu_m).min(axis=0)
    gap_m = np.maximum(away_m - place.serving_radius_m, 0.0)
    after = problem.prices.end * float(np.mean(end.user_aoi_slots * gap_m))
    assert math.isclose(plan.value, cost + after, rel_tol=1e-3)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), num_uavs=st.integers(1, 3), blur_m=st.sampled_from([0.0, 20.0]))
def test_polishing_never_makes_a_plan_dearer(seed: int, num_uavs: int, blur_m: float) -> None:
    place = scenario(num_uavs)
    coarse, polished = (make_plan(problem_of(place, seed, how, blur_m)) for how in (COARSE, POLISHED))
    assert polished.value <= coarse.value + 1e-4


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_polished_ways_keep_clear_of_obstacles(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.uniform(50.0, 400.0, 2) + rng.uniform(0.0, 100.0, (4, 2))
    wall = Obstacle("wall", 150.0, tuple((float(e), float(n)) for e, n in corners))
    problem = problem_of(scenario(2, (wall,)), seed, POLISHED)
    assert math.isfinite(flown(problem, make_plan(problem).path_enu_m)[0])


def test_polishing_gains_and_flies_at_many_speeds() -> None:
    place = scenario(2)
    values = [[make_plan(problem_of(place, s, how)).value for s in range(6)] for how in (COARSE, POLISHED)]
    assert np.mean(values[1]) < np.mean(values[0])
    speeds = make_plan(problem_of(place, 0, POLISHED)).first_action.speed_mps
    assert np.all(speeds <= place.max_speed_mps + 1e-9)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 10_000), shift_m=st.floats(0.0, float(SHIFT_M) - 0.01), to=st.floats(0.0, 2.0 * math.pi))
def test_users_left_out_of_a_shift_are_those_whom_it_cannot_concern(seed: int, shift_m: float, to: float) -> None:
    problem = problem_of(scenario(num_uavs=2), seed, POLISHED, blur_m=20.0)
    users = problem.users
    rng = np.random.default_rng(seed)
    path_m = rng.uniform(0.0, 1200.0, (POLISHED.horizon_slots, 2))
    others_gap_m = rng.uniform(0.0, 900.0, users.east_m.shape).astype(np.float32)
    others_gap_m[:, 0] = np.inf  # nobody else is there for the first
    desk = make_desk(problem.prices, *users.east_m.shape)
    who = desk.who[: _in_play(users, others_gap_m, path_m, 1, 2, desk)]
    left_out = np.setdiff1d(np.arange(users.present), who)
    east, north = path_m[1:3].T + shift_m * np.array([[math.sin(to)], [math.cos(to)]])
    away_m = np.hypot(users.east_m[1:3] - east[:, None], users.north_m[1:3] - north[:, None])
    own_gap_m = np.maximum(away_m - users.inner_m[1:3], 0.0)
    assert 0 in who
    assert np.all(own_gap_m[:, left_out] >= others_gap_m[1:3, left_out])


def test_a_kept_polished_plan_is_dropped_when_the_uav_is_elsewhere() -> None:
    place = scenario(1)
    problem = problem_of(place, 3, POLISHED)
    plan = make_plan(problem)
    kept = make_plan(problem, plan.shifted(0))
    assert kept.value <= plan.value + 1e-6
    moved = replace(problem.state, uav_pos_enu_m=problem.state.uav_pos_enu_m + 300.0)
    elsewhere = make_problem(place, problem.moves, moved, POLISHED)
    assert np.array_equal(make_plan(elsewhere, plan.shifted(0)).path_enu_m, make_plan(elsewhere).path_enu_m)


def test_blur_prefers_a_user_in_the_middle_of_the_disc() -> None:
    place = replace(scenario(1), collect_mbps=np.full(1, 0.02))
    how = replace(POLISHED, horizon_slots=1)
    state = initial_state(place, np.array([[600.0, 600.0 + place.serving_radius_m - 1.0]]))
    moves, blur = make_moves(place, how), np.full((1, 1), 100.0)
    sure, doubtful = (make_plan(make_problem(place, moves, state, how, None, b)) for b in (None, blur))
    near_m = [float(np.linalg.norm(p.path_enu_m[0, 0] - state.user_pos_enu_m[0])) for p in (sure, doubtful)]
    assert near_m[1] <= place.serving_radius_m - 100.0 + 1e-3
    assert near_m[1] <= near_m[0]


accels = st.sampled_from([2.5, 4.5, 9.0])
velocities = st.tuples(st.floats(-12.0, 12.0), st.floats(-12.0, 12.0))


def of_cruise(
    start: tuple[float, float], at: tuple[float, float], end: tuple[float, float], accel: float
) -> tuple[bool, float]:
    """Ask for the cruise of a leg that has one: whether one was found, and by how much what was found misses."""
    legs = Legs(15.0, 18.0, accel)
    way, _ = slot_motion(np.array(start), np.array(at), np.array(end), accel, 15.0, np.asarray(15.0))
    east, north, found = cruise(legs, (0.0, 0.0), start, (float(way[0]), float(way[1])), end)
    again, vel = slot_motion(np.array(start), np.array([east, north]), np.array(end), accel, 15.0, np.asarray(15.0))
    if found:
        assert vel == pytest.approx(end, abs=1e-6)
        assert math.hypot(east, north) <= legs.max_speed_mps * 1.001
    return found, float(np.max(np.abs(again - way)))


turns = st.floats(-math.pi / 2.0, math.pi / 2.0)
fast = st.floats(9.0, 18.0)


@settings(max_examples=200, deadline=None)
@given(velocities, velocities, velocities, accels)
def test_a_cruise_leads_where_the_world_says(
    start: tuple[float, float], at: tuple[float, float], end: tuple[float, float], accel: float
) -> None:
    found, off_m = of_cruise(start, at, end, accel)
    assert off_m < 0.02 or not found


@settings(max_examples=200, deadline=None)
@given(turns, turns, fast, fast, fast, accels)
def test_a_cruise_between_turns_of_a_right_angle_is_found(
    first: float, last: float, start: float, at: float, end: float, accel: float
) -> None:
    ways = ((start, 0.0), (at, first), (end, first + last))
    velocities_mps = [(speed * math.sin(heading), speed * math.cos(heading)) for speed, heading in ways]
    changes_s = sum(math.dist(*pair) for pair in itertools.pairwise(velocities_mps)) / accel
    found, _ = of_cruise(*velocities_mps, accel)
    assert found or changes_s > 10.0


def test_hardly_a_leg_that_can_be_flown_is_missed() -> None:
    rng, found = np.random.default_rng(2), []
    while len(found) < 1000:
        start, at, end = (tuple(map(float, v)) for v in rng.uniform(-12.7, 12.7, (3, 2)))
        if (math.dist(start, at) + math.dist(at, end)) / 4.5 < 14.0:
            found.append(of_cruise(start, at, end, 4.5)[0])
    assert np.mean(found) > 0.95


@settings(max_examples=100, deadline=None)
@given(velocities, velocities, accels, st.floats(0.0, 15.0), st.floats(0.0, 1.0))
def test_compiled_turns_are_the_worlds(
    start: tuple[float, float], end: tuple[float, float], accel: float, most_s: float, share: float
) -> None:
    theirs = make_turn(np.array(start), np.array(end), accel, most_s)
    ours = turn(Legs(15.0, 18.0, accel), start, end, most_s)
    assert ours == pytest.approx((float(theirs.half_rad), float(theirs.time_s)), abs=1e-9)
    way, _ = turn_motion(theirs, np.asarray(share * theirs.time_s))
    assert turn_way(start, end, ours, share) == pytest.approx(tuple(way), abs=1e-5)
    whole, _ = turn_motion(theirs, theirs.time_s)
    assert kernel_turn(start, end, accel, most_s) == pytest.approx((*whole, float(theirs.time_s)), abs=1e-5)


def flown_with_inertia(problem: Problem, place: Scenario, slots: int) -> tuple[list[bool], list[float]]:
    """Decide, fly, decide again: whether each move was legal, and how far from the plan each slot ended."""
    state, kept, legal, off_m = problem.state, None, [], []
    for _ in range(slots):
        plan = make_plan(make_problem(place, problem.moves, state, problem.settings), kept)
        action = plan.first_action
        end_mps = action.end_vel_enu_mps
        at = state.uav_pos_enu_m, state.uav_vel_enu_mps
        legal.append(bool(np.all(legal_moves(*at, action.vel_enu_mps, place, end_mps))))
        state, outcome = step(place, state, action, state.user_pos_enu_m)
        off_m.append(float(np.max(np.abs(state.uav_pos_enu_m - plan.path_enu_m[:, 0]))))
        legal.append(not np.any(outcome.left_area | outcome.hit_obstacle))
        kept = plan.shifted()
    return legal, off_m


@settings(max_examples=10, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    num_uavs=st.integers(1, 3),
    accel=accels,
    walled=st.booleans(),
    turns=st.sampled_from([(), HALF_TURNS_RAD]),
)
def test_with_inertia_every_slot_is_legal_and_ends_where_planned(
    seed: int, num_uavs: int, accel: float, walled: bool, turns: tuple[float, ...]
) -> None:
    wall = Obstacle("wall", 150.0, ((300.0, 300.0), (420.0, 320.0), (400.0, 450.0)))
    place = scenario(num_uavs, (wall,) if walled else ()).with_accel(accel)
    problem = problem_of(place, seed, replace(POLISHED, end_turns_rad=turns))
    legal, off_m = flown_with_inertia(problem, place, 5)
    assert all(legal)
    assert max(off_m) < 0.05


def test_with_inertia_polishing_pays_and_turns_before_the_slot_ends() -> None:
    place = scenario(2).with_accel(4.5)
    values = [[make_plan(problem_of(place, s, how)).value for s in range(6)] for how in (COARSE, POLISHED)]
    assert np.mean(values[1]) < np.mean(values[0])
    actions = [make_plan(problem_of(place, s, POLISHED)).first_action for s in range(6)]
    assert max(float(np.max(np.abs(a.end_vel_enu_mps - a.vel_enu_mps))) for a in actions) > 2.0


HEATED = replace(POLISHED, heated_sweeps=20)


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10_000), num_uavs=st.integers(1, 3), accel=st.sampled_from([2.5, 4.5, math.inf]))
def test_heat_never_makes_a_plan_dearer_and_draws_the_same_again(seed: int, num_uavs: int, accel: float) -> None:
    place = scenario(num_uavs).with_accel(accel)
    cold, heated, again = (make_plan(problem_of(place, seed, how)) for how in (POLISHED, HEATED, HEATED))
    assert heated.value <= cold.value
    assert heated.value == again.value
    assert np.array_equal(heated.path_enu_m, again.path_enu_m)


def test_heat_leads_out_of_plans_that_no_shift_improves() -> None:
    place = scenario(2).with_accel(4.5)
    longer = replace(POLISHED, polish_sweeps=POLISHED.polish_sweeps + HEATED.heated_sweeps)
    values = [[make_plan(problem_of(place, s, how)).value for s in range(8)] for how in (longer, HEATED)]
    assert np.mean(values[1]) < np.mean(values[0])


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000), num_uavs=st.integers(1, 3), accel=accels, walled=st.booleans())
def test_heated_plans_stay_flyable(seed: int, num_uavs: int, accel: float, walled: bool) -> None:
    wall = Obstacle("wall", 150.0, ((300.0, 300.0), (420.0, 320.0), (400.0, 450.0)))
    place = scenario(num_uavs, (wall,) if walled else ()).with_accel(accel)
    legal, off_m = flown_with_inertia(problem_of(place, seed, HEATED), place, 5)
    assert all(legal)
    assert max(off_m) < 0.05


def test_a_uav_blown_off_its_plan_comes_back_to_it() -> None:
    place = scenario(1).with_accel(4.5)
    problem = problem_of(place, 3, POLISHED)
    plan = make_plan(problem)
    off = replace(problem.state, uav_pos_enu_m=problem.state.uav_pos_enu_m + 4.0)
    again = make_plan(make_problem(place, problem.moves, off, POLISHED), plan.shifted(0))
    assert again.value <= plan.value * 1.05
    assert again.kept_value is not None


def test_nothing_is_compiled_anew_for_a_state_of_another_layout() -> None:
    place = scenario(2).with_accel(4.5)
    problem = problem_of(place, 1, POLISHED)
    kept = make_plan(problem).shifted(0)
    make_plan(problem, kept)
    compiled = {f: len(f.signatures) for f in (search, polish, keep_up, joint_price, ways_j, cruise)}
    wide = np.zeros((2, 4))
    wide[:, ::2] = problem.state.uav_pos_enu_m
    state = replace(problem.state, uav_pos_enu_m=wide[:, ::2], uav_vel_enu_mps=np.zeros((2, 4))[:, ::2])
    make_plan(make_problem(place, problem.moves, state, POLISHED), kept)
    assert {f: len(f.signatures) for f in compiled} == compiled
