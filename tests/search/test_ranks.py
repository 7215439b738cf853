"""Ranks of the beam's children: nodes that share ways and users left out of the sums, against plain sums of all."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from policy.search.kernel import (
    Children,
    Layer,
    Near,
    Scene,
    Trail,
    _gather,
    _pair_up,
    _rank,
    _slot,
    _spread,
    _take_near,
)
from policy.search.moves import make_moves
from policy.search.problem import Problem, make_problem
from policy.search.settings import SearchSettings
from policy.world.scenario import Area, Objective, Scenario
from policy.world.state import initial_state

HOW = SearchSettings(horizon_slots=3, num_headings=8, polish_sweeps=1, thrift=0.01)
NODES, DEPTH, USERS = 5, 1, 21


def problem_of(rng: np.random.Generator) -> Problem:
    place = Scenario(
        Area((40.0, -86.0), (2400.0, 2100.0)),
        np.array([[1200.0, 1000.0]]),
        rng.uniform(0.01, 0.05, USERS),
        objective=Objective(c_cover=1.0),
    )
    users = rng.uniform(0.0, 1.0, (USERS, 2)) * np.asarray(place.area.size_m)
    blur_m = rng.uniform(0.0, 60.0, (HOW.horizon_slots, USERS))
    return make_problem(place, make_moves(place, HOW), initial_state(place, users), HOW, None, blur_m)


def layer_of(problem: Problem, rng: np.random.Generator) -> Layer:
    """The first and the third node lie at one place, as near as sums of the same moves do."""
    pos_m = rng.uniform(600.0, 1500.0, (NODES, 2))
    pos_m[2] = pos_m[0] + 1e-12
    aoi = np.ones((NODES, problem.users.aoi_slots.size), np.float32)
    aoi[:, :USERS] = rng.uniform(1.0, 20.0, (NODES, USERS))
    numbers = np.arange(NODES)
    return Layer(NODES, numbers, numbers, pos_m, rng.uniform(0.0, 9.0, NODES), np.zeros(NODES), aoi)


def near_of(count: int) -> Near:
    rows = np.empty((6, count), np.float32)
    return Near(np.empty(count, np.uint32), rows, rows[:2].copy(), rows[0].copy(), np.empty(NODES, np.int64))


def others_of(problem: Problem, rng: np.random.Generator) -> np.ndarray:
    gap_m = rng.uniform(0.0, 500.0, problem.users.aoi_slots.size).astype(np.float32)
    gap_m[0], gap_m[1:6] = np.inf, 0.0  # nobody else is there for the first; the next are served
    return gap_m


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_ranks_are_plain_sums_over_all_users(seed: int) -> None:
    rng = np.random.default_rng(seed)
    problem = problem_of(rng)
    users, prices, moves = problem.users, problem.prices, problem.moves
    scene = Scene(users, prices, moves.table, moves.walls, problem.effort)
    start, layer, others_m = problem.start(0), layer_of(problem, rng), others_of(problem, rng)
    many = NODES * start.allowed.shape[1] + 1
    children = Children(np.empty(many), np.empty(many), np.empty((many, 2)))
    trail = Trail(np.zeros((3, 2)), np.zeros((3, 2)), np.zeros(3, np.int64), 0)
    crowd, near = np.empty((6, others_m.size), np.float32), near_of(others_m.size)
    _gather(users, DEPTH, others_m, crowd)
    slot = _slot(prices, DEPTH, 0.9, HOW.horizon_slots, users.present)
    reach_m = _spread(scene, start, layer, trail, DEPTH, False, children)
    legal = np.flatnonzero(np.isfinite(children.rank))
    _rank(scene, layer, crowd, near, slot, reach_m, children)

    node, to_m = legal // start.allowed.shape[1], children.pos_m[legal]
    away_m = np.hypot(users.east_m[DEPTH] - to_m[:, :1], users.north_m[DEPTH] - to_m[:, 1:])
    gap_m = np.minimum(np.maximum(away_m - users.inner_m[DEPTH], 0.0), others_m)[:, : users.present]
    miss = np.minimum(gap_m * users.fade_per_m[DEPTH, : users.present], 1.0)
    aged = users.weight[: users.present] * (1.0 + miss * layer.aoi_slots[node, : users.present])
    bonus = prices.cover * (1.0 - miss.mean(axis=1)) - prices.energy * children.spent_j[legal]
    age, wait = aged.sum(axis=1), (aged * gap_m).sum(axis=1)
    expected = layer.cost[node] + 0.9 * (age - bonus + prices.discount * prices.leaf * wait)
    np.testing.assert_allclose(children.rank[legal], expected, rtol=2e-4, atol=2e-4)
    assert legal.size > NODES


def test_users_are_left_out_and_nodes_at_one_place_are_paired() -> None:
    rng = np.random.default_rng(1)
    problem = problem_of(rng)
    layer, others_m = layer_of(problem, rng), others_of(problem, rng)
    crowd, near = np.empty((6, others_m.size), np.float32), near_of(others_m.size)
    _gather(problem.users, DEPTH, others_m, crowd)
    slot = _slot(problem.prices, DEPTH, 1.0, HOW.horizon_slots, USERS)
    _, whole = _take_near(crowd, near, layer, slot, 270.0, USERS)
    left_out = np.flatnonzero(near.apart)
    served = np.flatnonzero(others_m[:USERS] == 0.0)
    assert whole < others_m.size
    assert 0 in near.who[:whole]
    assert not np.intersect1d(near.who[:whole], [*left_out, *served]).size
    _pair_up(layer, near.twin, False)
    assert near.twin.tolist() == [2, 1, 0, 3, 4]
    _pair_up(layer, near.twin, True)
    assert near.twin.tolist() == [0, 1, 2, 3, 4]
