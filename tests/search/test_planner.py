"""The planner against exhaustive search, the world's transition and the world's airspace."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from policy.search.alternatives import Considered
from policy.search.kernel import Rounds, Scene, _legal
from policy.search.leaf import leaf_states
from policy.search.moves import make_moves
from policy.search.plan import Plan
from policy.search.planner import final_beam, make_plan
from policy.search.problem import Problem, make_problem
from policy.search.settings import SearchSettings, settings_for
from policy.world.actions import ActionSet, make_actions
from policy.world.airspace import legal_moves
from policy.world.geometry import pairwise_distance_m
from policy.world.scenario import Area, Objective, Obstacle, Scenario
from policy.world.state import WorldState, initial_state
from policy.world.transition import step

TINY = SearchSettings(horizon_slots=3, beam=125, num_headings=4, cell_m=0.001, discount=0.9, rebuilds=0)
TOWER = Obstacle("tower", 200.0, ((400.0, 300.0), (520.0, 320.0), (450.0, 480.0)))


def scenario(
    num_uavs: int = 1,
    num_users: int = 4,
    accel: float = math.inf,
    obstacles: tuple[Obstacle, ...] = (),
    objective: Objective | None = None,
) -> Scenario:
    launch = np.tile([[600.0, 600.0]], (num_uavs, 1))
    return Scenario(
        Area((40.0, -86.0), (1200.0, 1100.0), obstacles),
        launch,
        np.full(num_users, 0.02),
        max_accel_mps2=accel,
        objective=objective or Objective(),
    )


def state_of(place: Scenario, seed: int) -> WorldState:
    """Users anywhere, of any age."""
    rng = np.random.default_rng(seed)
    users = rng.uniform(0.0, 1.0, (place.num_users, 2)) * np.asarray(place.area.size_m)
    return replace(initial_state(place, users), user_aoi_slots=rng.integers(1, 20, place.num_users).astype(np.float64))


def problem_of(place: Scenario, state: WorldState, how: SearchSettings = TINY) -> Problem:
    return make_problem(place, make_moves(place, how), state, how)


def price(problem: Problem, actions: np.ndarray) -> float:
    """A joint plan [U, H] flown by the world's own transition and priced by hand; infinite where not legal."""
    place, state, how = problem.scenario, problem.state, problem.settings
    total, reachable = 0.0, problem.moves.table.reachable
    for depth, chosen in enumerate(actions.T):
        if depth > 0 and not np.all(reachable[actions[:, depth - 1], chosen]):
            return math.inf  # ends elsewhere than its move says
        joint = problem.moves.command(chosen)
        now = state.uav_pos_enu_m, state.uav_vel_enu_mps
        if not np.all(legal_moves(*now, joint.vel_enu_mps, place, joint.end_vel_enu_mps)):
            return math.inf
        state, outcome = step(place, state, joint, state.user_pos_enu_m)
        left = how.last_weight if state.slot == place.slots else 0.0
        slot = (1.0 + left) * np.mean(state.user_aoi_slots) - problem.prices.cover * np.mean(outcome.served)
        total += how.discount**depth * float(slot + problem.prices.energy * np.sum(outcome.energy_j))
    away_m = pairwise_distance_m(state.uav_pos_enu_m, state.user_pos_enu_m).min(axis=0)
    slots = np.maximum(away_m - place.serving_radius_m, 0.0) / (place.max_speed_mps * place.slot_s)
    wait = how.leaf_weight * np.mean(state.user_aoi_slots * slots) if state.slot < place.slots else 0.0
    return total + how.discount ** actions.shape[1] * float(wait)


@pytest.mark.parametrize(("accel", "turns"), [(math.inf, ()), (4.5, ()), (2.5, ()), (4.5, (1.0,)), (2.5, (-0.8,))])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_wide_beam_finds_what_exhaustive_search_finds(seed: int, accel: float, turns: tuple[float, ...]) -> None:
    place = scenario(accel=accel, obstacles=(TOWER,), objective=Objective(c_cover=1.0, c_energy=5.0))
    how = replace(TINY, end_turns_rad=turns, horizon_slots=2 if turns else 3)
    problem = problem_of(place, state_of(place, seed), how)
    every = itertools.product(range(problem.moves.actions.size), repeat=how.horizon_slots)
    best = min(price(problem, np.array([actions])) for actions in every)
    plan = make_plan(problem)
    assert plan.value == pytest.approx(best, rel=1e-5)
    assert price(problem, plan.actions) == pytest.approx(best, rel=1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_the_value_is_what_the_world_makes_of_the_joint_plan(seed: int) -> None:
    place = scenario(num_uavs=3, num_users=12, accel=4.5)
    problem = problem_of(place, state_of(place, seed))
    plan = make_plan(problem)
    assert plan.value == pytest.approx(price(problem, plan.actions), rel=1e-5)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_what_is_left_when_the_campaign_ends_counts_beside_its_slot(seed: int) -> None:
    place, how = scenario(objective=Objective(c_cover=1.0, c_energy=5.0)), replace(TINY, last_weight=2.0)
    state = replace(state_of(place, seed), slot=place.slots - 3)
    problem = problem_of(place, state, how)
    every = itertools.product(range(problem.moves.actions.size), repeat=3)
    best = min(price(problem, np.array([actions])) for actions in every)
    plan = make_plan(problem)
    assert plan.value == pytest.approx(best, rel=1e-5)
    assert price(problem, plan.actions) == pytest.approx(best, rel=1e-5)


@pytest.mark.parametrize("seed", range(5))
def test_a_kept_plan_never_gets_worse(seed: int) -> None:
    place = scenario(num_uavs=2, num_users=12)
    how = replace(TINY, beam=2, horizon_slots=6, cell_m=200.0)
    problem = problem_of(place, state_of(place, seed), how)
    good = make_plan(problem_of(place, state_of(place, seed), replace(how, beam=60, cell_m=1.0)))
    kept = make_plan(problem, good.shifted(0))
    rounding = 8.0 * float(np.finfo(np.float32).eps) * good.value  # ages are summed in single precision, in two ways
    assert kept.value <= good.value + rounding
    assert kept.kept_value is not None
    assert kept.value - rounding <= kept.kept_value <= good.value + rounding


@settings(max_examples=60, deadline=None)
@given(
    accel=st.sampled_from([math.inf, 4.5, 2.5, 1.3]),
    east=st.floats(0.0, 1200.0),
    north=st.floats(0.0, 1100.0),
    last=st.integers(0, 32),
)
def test_the_kernel_and_the_world_agree_on_what_is_legal(accel: float, east: float, north: float, last: int) -> None:
    place = scenario(accel=accel, obstacles=(TOWER,))
    problem = problem_of(place, state_of(place, 0), SearchSettings(end_turns_rad=(0.7,)))
    vel, end = problem.moves.table.vel_mps, problem.moves.table.end_mps
    last %= len(vel)
    scene = Scene(problem.users, problem.prices, problem.moves.table, problem.moves.walls, problem.effort)
    ours = _legal(scene, problem.start(0), (east, north), last)
    worlds = legal_moves(np.array([[east, north]]), end[last][None], vel, place, end)
    worlds &= problem.moves.table.reachable[last]
    if worlds.any():
        assert np.array_equal(ours, worlds)
    else:
        assert np.array_equal(np.flatnonzero(ours), [0])


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), accel=st.sampled_from([math.inf, 4.5, 2.0]), num_uavs=st.integers(1, 3))
def test_a_plan_is_legal_to_its_end(seed: int, accel: float, num_uavs: int) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.uniform(50.0, 400.0, 2) + rng.uniform(0.0, 100.0, (4, 2))
    wall = Obstacle("wall", 150.0, tuple((float(e), float(n)) for e, n in corners))
    place = scenario(num_uavs, 10, accel, (wall,))
    problem = problem_of(place, state_of(place, seed), SearchSettings(horizon_slots=6, beam=8))
    assert math.isfinite(price(problem, make_plan(problem).actions))


def test_the_same_question_gets_the_same_answer() -> None:
    place = scenario(num_uavs=3, num_users=20)
    plans = [make_plan(problem_of(place, state_of(place, 7), SearchSettings(horizon_slots=6))) for _ in range(2)]
    assert np.array_equal(plans[0].actions, plans[1].actions)
    assert plans[0].value == plans[1].value


def test_eleven_uavs_serve_everybody_better_than_two() -> None:
    how = SearchSettings(horizon_slots=6, beam=8, rebuilds=1)
    values = []
    for num_uavs in (2, 11):
        place = scenario(num_uavs, 92)
        values.append(make_plan(problem_of(place, state_of(place, 1), how)).value)
    assert values[1] < values[0]


def test_absent_users_and_uavs_do_not_count() -> None:
    place = scenario(num_uavs=2, num_users=8)
    state = state_of(place, 3)
    state.user_active[:4] = False
    state.uav_active[1] = False
    moved = replace(state, user_pos_enu_m=state.user_pos_enu_m.copy(), uav_pos_enu_m=state.uav_pos_enu_m.copy())
    moved.user_pos_enu_m[:4] = 0.0
    moved.uav_pos_enu_m[1] = 10.0
    first, second = (make_plan(problem_of(place, s, SearchSettings())) for s in (state, moved))
    assert np.array_equal(first.actions[0], second.actions[0])
    assert first.value == second.value
    assert not first.actions[1].any()


def test_nobody_to_plan_and_nobody_to_serve() -> None:
    place = scenario(num_uavs=1, num_users=2)
    state = state_of(place, 0)
    state.user_active[:] = False
    assert make_plan(problem_of(place, state)).value == 0.0
    state.uav_active[:] = False
    assert make_plan(problem_of(place, state)).value == 0.0


def test_an_injected_leaf_value_decides() -> None:
    place = scenario(num_uavs=2, num_users=6)
    problem = problem_of(place, state_of(place, 4), SearchSettings(horizon_slots=1, rebuilds=0))

    def west_is_best(states: WorldState) -> np.ndarray:
        return 1e3 * states.uav_pos_enu_m[..., 0].sum(axis=-1)

    assert np.allclose(make_plan(problem, leaf=west_is_best).path_enu_m[:, 0], [[330.0, 600.0]] * 2)


@pytest.mark.parametrize("seed", range(3))
def test_an_injected_leaf_value_that_is_the_closed_form_leads_to_the_same_plan(seed: int) -> None:
    place = scenario(num_uavs=3, num_users=9)
    problem = problem_of(place, state_of(place, seed), SearchSettings(horizon_slots=5, beam=12, rebuilds=0))
    users = problem.users

    def closed_form(states: WorldState) -> np.ndarray:
        away_m = pairwise_distance_m(states.uav_pos_enu_m, states.user_pos_enu_m).min(axis=-2)
        gap_m = np.maximum(away_m - users.inner_m[-1, : users.present], 0.0)
        price = problem.prices.end * users.weight[: users.present] * states.user_aoi_slots * gap_m
        return np.asarray(np.sum(price, axis=-1))

    worse = make_plan(replace(problem, settings=replace(problem.settings, rounds=1)))
    compiled, asked = (make_plan(problem, worse.shifted(1), leaf) for leaf in (None, closed_form))
    assert np.allclose(asked.path_enu_m, compiled.path_enu_m)
    assert math.isclose(asked.value, compiled.value, rel_tol=1e-4)
    for ours, theirs in zip(asked.alternatives, compiled.alternatives, strict=True):
        assert [other.action for other in ours] == [other.action for other in theirs]


@pytest.mark.parametrize("accel", [math.inf, 4.5])
def test_leaf_states_are_where_the_world_would_be(accel: float) -> None:
    place = scenario(num_uavs=2, num_users=6, accel=accel)
    problem = problem_of(place, state_of(place, 4), SearchSettings(horizon_slots=4, beam=10, end_turns_rad=(0.7, -0.7)))
    plan = make_plan(problem)
    beam = final_beam(problem, plan, 1)
    states = leaf_states(problem, beam, 1, plan.actions, plan.path_enu_m)
    for row in range(beam.cost.size):
        actions = plan.actions.copy()
        actions[1] = beam.actions[row]
        end = flown(problem, replace(plan, actions=actions))
        for name in ("uav_pos_enu_m", "uav_vel_enu_mps", "uav_energy_j", "user_aoi_slots", "user_data_mb"):
            assert np.allclose(getattr(states, name)[row], getattr(end, name)), name


def flown(problem: Problem, plan: Plan) -> WorldState:
    state = problem.state
    for chosen in plan.actions.T:
        state, _ = step(problem.scenario, state, problem.moves.command(chosen), state.user_pos_enu_m)
    return state


def test_a_uav_outside_comes_back() -> None:
    for accel in (math.inf, 4.5):
        place = scenario(num_users=6, accel=accel)
        for outside in ([-3.0, 500.0], [-900.0, 500.0], [600.0, 1100.4]):
            state = replace(state_of(place, 0), uav_pos_enu_m=np.array([outside]))
            end = make_plan(problem_of(place, state, SearchSettings())).path_enu_m[0]
            middle = np.array([600.0, 550.0])
            assert np.linalg.norm(end[0] - middle) < np.linalg.norm(np.array(outside) - middle)


def test_the_horizon_ends_with_the_campaign() -> None:
    place = scenario()
    problem = problem_of(place, replace(state_of(place, 0), slot=place.slots - 2))
    assert problem.horizon_slots == 2
    assert make_plan(problem).actions.shape == (1, 2)


@pytest.mark.parametrize(("accel", "turned"), [(math.inf, False), (4.5, False), (2.5, True)])
def test_slots_may_end_turned_where_a_right_angle_takes_most_of_one(accel: float, turned: bool) -> None:
    place = scenario(accel=accel)
    how = settings_for(place)
    assert bool(how.end_turns_rad) is turned
    table = make_moves(place, how).table
    assert np.array_equal(table.end_mps, table.vel_mps) is not turned
    assert np.allclose(np.hypot(*table.end_mps.T), np.hypot(*table.vel_mps.T))


def test_moves_that_only_end_differently_are_one_alternative() -> None:
    actions = make_actions(4, (18.0,))
    twice = ActionSet(np.tile(actions.heading_rad, 2), np.tile(actions.speed_mps, 2))
    found = Rounds(
        kept_price=0.0,
        price=np.array([[3.0, 1.0, 2.0, 4.0, 5.0, math.nan]]),
        action=np.array([[2, 1, 6, 7, 3, 4]]),  # 6 commands what 1 does, 7 what 2 does
        best=np.array([1]),
    )
    alternatives = Considered(twice, found).of(0)
    assert [(other.action, other.value) for other in alternatives] == [(2, 3.0), (3, 5.0)]


def test_shifted_plans_end_open_and_bad_settings_are_refused() -> None:
    place = scenario()
    plan = make_plan(problem_of(place, state_of(place, 0)))
    kept = plan.shifted()
    assert kept.actions.tolist() == [[*plan.actions[0, 1:].tolist(), -1]]
    assert np.array_equal(kept.vel_enu_mps[:, :-1], plan.vel_enu_mps[:, 1:])
    beyond = plan.shifted(plan.actions.shape[1] + 3)
    assert np.all(beyond.actions == -1)
    assert np.array_equal(beyond.path_enu_m, np.repeat(plan.path_enu_m[:, -1:], plan.actions.shape[1], axis=1))
    with pytest.raises(ValueError, match="forward"):
        plan.shifted(-1)
    for wrong in (
        {"beam": 0},
        {"speed_shares": ()},
        {"speed_shares": (1.5,)},
        {"discount": 0.0},
        {"rebuilds": -1},
        {"last_weight": -1.0},
    ):
        with pytest.raises(ValueError, match=r"must|need"):
            SearchSettings(**wrong)
    with pytest.raises(ValueError, match="predicted places"):
        make_problem(place, make_moves(place, TINY), state_of(place, 0), TINY, np.zeros((1, 4, 2)))
