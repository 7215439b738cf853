"""The N-depth search of the paper as it is printed, Eq. 13-14: a state's value is averaged over depths.

    V(1)(s) = f_val(s)        V(n)(s) = 1/n V(1)(s) + (n-1)/n max_a ( r(s, a) + gamma V(n-1)(sigma(s, a)) )
    a = argmax_a ( r(s, a) + gamma V(N)(sigma(s, a)) )

Joint actions grow as A^U, so the maximum runs over clipped sets: UAV after UAV, each of its A actions is tried with
the best joint actions of those before it (the others hover), and the best ``children`` by r + gamma f_val are kept.
That is A + (U - 1) children A states a node instead of A^U, all nodes of a depth in one batch. The planner that flies
by default is another one (``policy.search.planner``).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from policy.model.states import StateBatch, take
from policy.world.actions import ActionSet
from policy.world.airspace import legal_moves
from policy.world.arrays import BoolArray, FloatArray, IntArray
from policy.world.scenario import Scenario

DEEPEST = 5
"""Of the paper's Table I; the tree grows as children^N."""


@dataclass(frozen=True)
class TreeSettings:
    """How deep and how wide."""

    depth: int = 3  # N
    children: int = 3  # joint actions kept at a node
    root_children: int = 6  # at the root

    def __post_init__(self) -> None:
        """Refuse what cannot be searched."""
        if not 1 <= self.depth <= DEEPEST or min(self.children, self.root_children) < 1:
            raise ValueError(f"need 1 <= depth <= {DEEPEST} and at least one child: {self}")


class NextState(Protocol):
    """sigma(s, a) of Eq. 12 and r(s, a) of Eq. 8, for several joint actions of each of several states."""

    def __call__(self, states: StateBatch, vel_command_mps: FloatArray) -> tuple[StateBatch, FloatArray]:
        """States [B], commands [B, C, U, 2] -> next states [B C], those of one state in a row; rewards [B, C]."""


class StateValue(Protocol):
    """f_val of Eq. 13, in the unit of the reward."""

    def __call__(self, states: StateBatch) -> FloatArray:
        """States [B] -> [B], higher is better."""


@dataclass(frozen=True)
class Tree:
    """What a search asks."""

    scenario: Scenario
    actions: ActionSet
    next_state: NextState
    value: StateValue
    gamma: float
    settings: TreeSettings


@dataclass(frozen=True)
class Choice:
    """The root's joint actions kept, best first: action indices [C, U] and r + gamma V(N) [C]."""

    actions: IntArray
    value: FloatArray


@dataclass(frozen=True)
class _Children:
    """C joint actions of each of B nodes and where they lead. ``value`` is V(1) of the next states."""

    actions: IntArray  # [B, C, U]
    reward: FloatArray  # [B, C]; minus infinity: no such action
    states: StateBatch  # [B C]
    value: FloatArray  # [B, C]

    def best(self, gamma: float, value: FloatArray) -> FloatArray:
        """max_a r + gamma V: [B]."""
        return np.asarray(np.max(self.reward + gamma * value, axis=1))


def choose(tree: Tree, root: StateBatch) -> Choice:
    """Eq. 14 for one state (B = 1)."""
    children = _expand(tree, root, tree.settings.root_children)
    value = node_value(tree, children.states, tree.settings.depth, children.value.ravel())
    total = children.reward[0] + tree.gamma * value
    order = np.argsort(-total, kind="stable")
    order = order[np.isfinite(total[order])]
    return Choice(children.actions[0][order], total[order])


def node_value(tree: Tree, states: StateBatch, depth: int, leaf_value: FloatArray | None = None) -> FloatArray:
    """V(n) of states [B] by Eq. 13; ``leaf_value`` is V(1) where it is known already."""
    first = tree.value(states) if leaf_value is None else leaf_value
    if depth == 1:
        return first
    children = _expand(tree, states, tree.settings.children)
    after = node_value(tree, children.states, depth - 1, children.value.ravel()).reshape(children.value.shape)
    return np.asarray(first / depth + (depth - 1) / depth * children.best(tree.gamma, after))


def _expand(tree: Tree, states: StateBatch, keep: int) -> _Children:
    """UAV after UAV, the best ``keep`` joint actions of each node."""
    nodes, uavs = states.uav_energy_j.shape
    legal = _legal(tree, states)
    joint = np.zeros((nodes, 1, uavs), dtype=np.int64)
    found: _Children | None = None
    for uav in range(uavs):
        tried = np.repeat(joint, tree.actions.size, axis=1)
        tried[:, :, uav] = np.tile(np.arange(tree.actions.size), joint.shape[1])
        allowed = np.take_along_axis(legal[:, uav], tried[:, :, uav], axis=1)
        if found is not None:
            allowed = allowed & np.repeat(np.isfinite(found.reward), tree.actions.size, axis=1)
        found = _best(tree, _tried(tree, states, tried, allowed), keep)
        joint = found.actions
    assert found is not None, "a campaign has UAVs"
    return found


def _legal(tree: Tree, states: StateBatch) -> BoolArray:
    """[B, U, A]: stays inside and clear; who does not fly, or has no legal move left, hovers."""
    vel = tree.actions.vel_enu_mps
    legal: BoolArray = np.array(
        legal_moves(states.uav_pos_enu_m[:, :, None], states.uav_vel_enu_mps[:, :, None], vel, tree.scenario)
    )
    legal &= states.uav_active[..., None]
    legal[..., 0] |= ~legal.any(axis=-1)
    return legal


def _tried(tree: Tree, states: StateBatch, actions: IntArray, allowed: BoolArray) -> _Children:
    """Joint actions [B, C, U] of every node, flown by the model."""
    after, reward = tree.next_state(states, tree.actions.vel_enu_mps[actions])
    value = tree.value(after).reshape(reward.shape)
    return _Children(actions, np.where(allowed, reward, -np.inf), after, value)


def _best(tree: Tree, children: _Children, keep: int) -> _Children:
    """The ``keep`` best of each node by r + gamma f_val."""
    nodes, count = children.value.shape
    order = np.argsort(-(children.reward + tree.gamma * children.value), axis=1, kind="stable")[:, :keep]
    rows = (np.arange(nodes)[:, None] * count + order).ravel()
    return _Children(
        actions=np.take_along_axis(children.actions, order[..., None], axis=1),
        reward=np.take_along_axis(children.reward, order, axis=1),
        states=take(children.states, rows),
        value=np.take_along_axis(children.value, order, axis=1),
    )
