"""Eq. 13-14 against the recursion written out, on a toy world and on the real one."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from policy.model.checkpoint import load_evaluator
from policy.model.states import STEPS, StateBatch, Units, stack_states, take
from policy.search.next_state import NEXT_STATES, LearnedValue, Physics, next_state, world_state
from policy.search.paper_tree import Tree, TreeSettings, choose, node_value
from policy.world.actions import paper_actions
from policy.world.arrays import FloatArray
from policy.world.reward import reward
from policy.world.scenario import Area, Scenario
from policy.world.state import JointAction, initial_state
from policy.world.transition import step

GAMMA = 0.9
ROUGHLY_M = {"exact": 1e-9, "hybrid": 1e-9, "learned": 90.0, "printed": 90.0}
"""How well each knows where a UAV gets: the learned one to a third of the way."""


def make_scenario(uavs: int, users: int = 4, side_m: float = 3000.0) -> Scenario:
    return Scenario(
        Area((0.0, 0.0), (side_m, side_m)), np.full((uavs, 2), 0.5 * side_m), np.full(users, 0.02), slots=20
    )


def root(scenario: Scenario, seed: int = 0) -> StateBatch:
    rng = np.random.default_rng(seed)
    places = rng.uniform(0.0, scenario.area.size_m, (scenario.num_users, 2))
    ages = rng.integers(1, 20, scenario.num_users).astype(float)
    state = replace(initial_state(scenario, places), user_aoi_slots=ages, user_data_mb=0.3 * ages)
    return stack_states([state], np.zeros((1, scenario.num_users, STEPS, 2)))


class Toy:
    """UAVs move as commanded; rewards and values are rough, nonlinear functions of where they are."""

    def __init__(self) -> None:
        self.flown = 0

    def next_state(self, states: StateBatch, vel_command_mps: FloatArray) -> tuple[StateBatch, FloatArray]:
        nodes, count = vel_command_mps.shape[:2]
        self.flown += nodes * count
        start = take(states, np.repeat(np.arange(nodes), count))
        moved = start.uav_pos_enu_m + 15.0 * vel_command_mps.reshape(nodes * count, -1, 2)
        earned = np.sin(moved / 170.0).sum(axis=(1, 2)).reshape(nodes, count)
        return replace(start, uav_pos_enu_m=moved), earned

    def value(self, states: StateBatch) -> FloatArray:
        return 3.0 * np.cos(states.uav_pos_enu_m / 230.0).prod(axis=2).sum(axis=1)


def toy_tree(uavs: int, depth: int, children: int, root_children: int | None = None) -> tuple[Tree, Toy]:
    toy, scenario = Toy(), make_scenario(uavs)
    wide = TreeSettings(depth, children, root_children or children)
    return Tree(scenario, paper_actions(18.0), toy.next_state, toy.value, GAMMA, wide), toy


def written_out(toy: Toy, states: StateBatch, depth: int) -> float:
    """Eq. 13 with the maximum over all joint actions."""
    first = float(toy.value(states)[0])
    if depth == 1:
        return first
    vel, uavs = paper_actions(18.0).vel_enu_mps, states.uav_active.shape[1]
    best = -np.inf
    for joint in itertools.product(range(9), repeat=uavs):
        after, earned = toy.next_state(states, vel[list(joint)][None, None])
        best = max(best, float(earned[0, 0]) + GAMMA * written_out(toy, after, depth - 1))
    return first / depth + (depth - 1) / depth * best


@pytest.mark.parametrize(("uavs", "depth", "all_of"), [(1, 1, 9), (1, 2, 9), (1, 3, 9), (2, 2, 81)])
def test_unclipped_it_is_equation_13(uavs: int, depth: int, all_of: int) -> None:
    tree, toy = toy_tree(uavs, depth, all_of)
    states = root(tree.scenario)
    assert node_value(tree, states, depth)[0] == pytest.approx(written_out(toy, states, depth))


@pytest.mark.parametrize(("uavs", "depth", "all_of"), [(1, 3, 9), (2, 1, 81)])
def test_unclipped_it_is_equation_14(uavs: int, depth: int, all_of: int) -> None:
    tree, toy = toy_tree(uavs, depth, all_of)
    states, vel = root(tree.scenario), tree.actions.vel_enu_mps
    totals = {}
    for joint in itertools.product(range(9), repeat=uavs):
        after, earned = toy.next_state(states, vel[list(joint)][None, None])
        totals[joint] = float(earned[0, 0]) + GAMMA * written_out(toy, after, depth)
    chosen = choose(tree, states)
    assert tuple(chosen.actions[0].tolist()) == max(totals, key=totals.__getitem__)
    np.testing.assert_allclose(chosen.value, [totals[tuple(joint.tolist())] for joint in chosen.actions])
    assert np.all(np.diff(chosen.value) <= 0.0)


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 3), st.integers(1, 5), st.integers(0, 50))
def test_clipping_never_promises_more(depth: int, children: int, seed: int) -> None:
    clipped, _ = toy_tree(1, depth, children)
    whole, _ = toy_tree(1, depth, 9)
    states = root(clipped.scenario, seed)
    moved = replace(states, uav_pos_enu_m=states.uav_pos_enu_m + np.random.default_rng(seed).uniform(-300, 300, 2))
    assert node_value(clipped, moved, depth)[0] <= node_value(whole, moved, depth)[0] + 1e-9


def test_the_work_grows_linearly_with_uavs() -> None:
    flown = []
    for uavs in (1, 2, 11):
        tree, toy = toy_tree(uavs, 2, 3, 3)
        choose(tree, root(tree.scenario))
        flown.append(toy.flown)
    each = [9 + 27 * (uavs - 1) for uavs in (1, 2, 11)]
    assert flown == [nodes + 3 * nodes for nodes in each]


def test_batches_do_not_mix() -> None:
    tree, _ = toy_tree(2, 3, 2)
    one, other = root(tree.scenario, 1), root(tree.scenario, 2)
    moved = replace(other, uav_pos_enu_m=other.uav_pos_enu_m + 120.0)
    both = StateBatch(*(np.concatenate(pair) for pair in zip(vars(one).values(), vars(moved).values(), strict=True)))
    together = node_value(tree, both, 3)
    assert together.tolist() == [node_value(tree, one, 3)[0], node_value(tree, moved, 3)[0]]
    assert np.array_equal(take(both, np.array([1, 1])).uav_pos_enu_m[1], moved.uav_pos_enu_m[0])


def test_nobody_leaves_the_map_and_who_is_down_hovers() -> None:
    scenario = make_scenario(3, side_m=200.0)  # no move of 270 m stays inside
    tree, _ = toy_tree(3, 2, 4)
    states = root(scenario)
    assert not choose(replace(tree, scenario=scenario), states).actions.any()
    down = replace(root(tree.scenario), uav_active=np.array([[True, False, True]]))
    kept = choose(tree, down).actions
    assert not kept[:, 1].any()
    assert kept[:, [0, 2]].any()


@pytest.mark.parametrize("kind", NEXT_STATES)
def test_next_states_keep_their_meaning(kind: str) -> None:
    scenario, evaluator = make_scenario(2), load_evaluator()
    units = Units.of(scenario)
    states = root(scenario)
    command = np.array([[[[18.0, 0.0], [0.0, -18.0]]]])
    after, earned = next_state(kind, scenario, evaluator, units)(states, command)
    assert earned.shape == (1, 1)
    assert after.user_steps_m.shape == states.user_steps_m.shape
    assert np.all(after.user_aoi_slots >= 1.0)
    assert np.all(after.uav_energy_j < states.uav_energy_j)
    way_m = after.uav_pos_enu_m[0, 0] - states.uav_pos_enu_m[0, 0]
    np.testing.assert_allclose(way_m, [270.0, 0.0], atol=ROUGHLY_M[kind])


@pytest.mark.parametrize("kind", ["learned", "printed"])
def test_learned_next_states_are_the_network_s_of_each_joint_action(kind: str) -> None:
    """f_1 and f_2 by ``predict_next`` for each joint action by itself; the reward is Eq. 8 by Def. 1 and 2 there."""
    scenario, evaluator = make_scenario(2, users=9, side_m=900.0), load_evaluator()
    units, states = Units.of(scenario), root(scenario, 4)
    pair = take(states, np.array([0, 0]))
    moved = replace(pair, uav_pos_enu_m=pair.uav_pos_enu_m + np.array([[[0.0, 0.0]], [[150.0, -90.0]]]))
    vel = paper_actions(18.0).vel_enu_mps
    commands = np.stack([vel[[[0, 3], [1, 1], [8, 2]]], vel[[[4, 4], [5, 0], [2, 7]]]])
    after, earned = next_state(kind, scenario, evaluator, units)(moved, commands)
    for node, choice in itertools.product(range(2), range(3)):
        alone = take(moved, np.array([node]))
        told = evaluator.predict_next(alone, commands[node, choice][None, None], units)
        row = take(after, np.array([3 * node + choice]))
        for name in ("uav_pos_enu_m", "uav_vel_enu_mps", "uav_energy_j", "user_pos_enu_m", "user_steps_m"):
            np.testing.assert_allclose(getattr(row, name), getattr(told, name), rtol=1e-5, atol=1e-3, err_msg=name)
        away_m = np.linalg.norm(told.uav_pos_enu_m[0][:, None] - told.user_pos_enu_m[0][None], axis=-1).min(axis=0)
        near = away_m <= scenario.serving_radius_m
        ages = np.where(near, 1.0, alone.user_aoi_slots[0] + 1.0)
        kept_mb = np.where(near, 0.0, alone.user_data_mb[0] + 0.3)
        fresher = 10.0 * (alone.user_aoi_slots[0] - ages) + (alone.user_data_mb[0] - kept_mb)
        assert earned[node, choice] == pytest.approx(fresher.mean(), rel=1e-6)
        np.testing.assert_allclose(
            row.user_aoi_slots[0], told.user_aoi_slots[0] if kind == "printed" else ages, rtol=1e-4
        )
    assert len(set(np.round(earned.ravel(), 6))) > 1  # whom an action serves decides


def test_who_is_told_to_run_empty_costs_the_penalty_and_serves_nobody() -> None:
    """By Eq. 8 and Def. 2: f_1 gives it nothing left, so r_t^- counts it and nobody's age falls."""

    class Empty:
        spec = load_evaluator().spec

        def predict_next(self, states: StateBatch, vel_command_mps: FloatArray, units: Units) -> StateBatch:
            return replace(states, uav_energy_j=np.zeros_like(states.uav_energy_j))

    scenario = make_scenario(1, users=3, side_m=300.0)
    states = root(scenario)
    after, earned = next_state("learned", scenario, Empty(), Units.of(scenario))(states, np.zeros((1, 1, 1, 2)))
    assert not after.uav_active.any()
    np.testing.assert_array_equal(after.user_aoi_slots, states.user_aoi_slots + 1.0)
    assert earned[0, 0] == pytest.approx(-10.0 - 0.3 - scenario.objective.penalty)


def test_exact_is_the_world_itself() -> None:
    scenario, states = make_scenario(2), root(make_scenario(2), 3)
    command = np.array([[[[18.0, 0.0], [0.0, 0.0]]]])
    after, earned = Physics(scenario, None, Units.of(scenario))(states, command)
    before = world_state(states)
    action = JointAction(np.array([[np.pi / 2.0, 0.0]]), np.array([[18.0, 0.0]]))
    expected, outcome = step(scenario, before, action, states.user_pos_enu_m)
    np.testing.assert_allclose(after.uav_pos_enu_m, expected.uav_pos_enu_m)
    np.testing.assert_array_equal(after.user_aoi_slots, expected.user_aoi_slots)
    np.testing.assert_allclose(earned[0], reward(scenario, before, expected, outcome))


def test_the_value_is_in_the_unit_of_the_reward() -> None:
    """Where nobody is ever served again: c (mean kappa_t - (1 - g) sum g^(k-1) kappa_t+k)."""

    class Never:
        spec = load_evaluator().spec

        def value(self, states: StateBatch, units: Units) -> FloatArray:
            gamma = self.spec.gamma
            ahead = states.user_aoi_slots.mean(axis=1)[:, None] + np.arange(1, 2000)
            return -np.sum(gamma ** np.arange(1999) * ahead, axis=1)

    scenario, states = make_scenario(1), root(make_scenario(1))
    units, gamma = Units.of(scenario), Never.spec.gamma
    price = scenario.objective.c_aoi + scenario.objective.c_collect * 0.02 * 15.0
    expected = -price * sum(gamma**k for k in range(2000))  # every slot everybody ages by one
    assert LearnedValue(scenario, Never(), units)(states)[0] == pytest.approx(expected, rel=1e-6)


def test_unknown_names_and_sizes_are_refused() -> None:
    scenario = make_scenario(1)
    with pytest.raises(ValueError, match="exact, hybrid, learned, printed"):
        next_state("guess", scenario, load_evaluator(), Units.of(scenario))
    for wrong in ({"depth": 0}, {"depth": 6}, {"children": 0}):
        with pytest.raises(ValueError, match="depth"):
            TreeSettings(**wrong)
