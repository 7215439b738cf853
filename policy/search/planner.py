"""Plans for all UAVs: one after the other, each with the others' plans held fixed, for several rounds.

All plans share one price, so a UAV's new plan is taken only when the whole fleet is better off, and each slot starts
from the plans kept from the slot before: plans never get worse while users' places do not surprise. One UAV at a
time gets stuck where two would have to change together, so a slot also tries what comes of throwing one UAV's plan
away: the others close the gap first, then it is planned anew. Linear in U, where joint actions cost A^U.
"""

from dataclasses import dataclass, replace

import numpy as np

from policy.search.kernel import NO_MOVE, Beam, Scene, follow, search
from policy.search.leaf import LeafValue, leaf_states
from policy.search.plan import Alternative, Plan
from policy.search.problem import Float32Array, Problem
from policy.world.arrays import FloatArray, IntArray

ALTERNATIVES = 3


@dataclass
class _Draft:
    """The plans so far. ``gap_m`` [U, H, N] metres from each UAV's serving radius to each user; infinite: no plan."""

    trail: IntArray  # [U, H]
    path_m: FloatArray  # [U, H, 2]
    gap_m: Float32Array


def make_plan(problem: Problem, incumbent: IntArray | None = None, leaf: LeafValue | None = None) -> Plan:
    """The best joint plan found. ``incumbent`` [U, >= 1] kept actions (``Plan.shifted``), None at the start."""
    order = [int(uav) for uav in problem.planned]
    best = _improve(problem, incumbent, order, leaf)
    kept_value = None if incumbent is None else best.kept_value
    for uav in _rebuilt(problem, order):
        without = best.actions.copy()
        without[uav] = NO_MOVE
        other = _improve(problem, without, [u for u in order if u != uav] + [uav], leaf)
        best = other if other.value < best.value else best
    return replace(best, kept_value=kept_value)


def final_beam(problem: Problem, plan: Plan, uav: int) -> Beam:
    """The last layer of one more search for ``uav`` with the others on ``plan``: for learners and for inspection."""
    return _search_one(problem, _draft(problem, plan.actions), uav)


def _rebuilt(problem: Problem, order: list[int]) -> list[int]:
    """Which UAVs' plans are thrown away in this slot: all take their turns."""
    if len(order) < 2:
        return []
    count = min(problem.settings.rebuilds, len(order))
    return [order[(problem.state.slot * count + index) % len(order)] for index in range(count)]


def _improve(problem: Problem, incumbent: IntArray | None, order: list[int], leaf: LeafValue | None) -> Plan:
    """Rounds over the UAVs in ``order`` until none changes its plan."""
    draft = _draft(problem, incumbent)
    values: list[float] = []
    kept_value = 0.0
    alternatives: list[tuple[Alternative, ...]] = [()] * problem.scenario.num_uavs
    for _ in range(problem.settings.rounds):
        before = draft.trail.copy()
        for uav in order:
            beam = _search_one(problem, draft, uav)
            prices = _prices(problem, draft, beam, uav, leaf)
            best = int(np.argmin(prices))  # the kept plan comes first and wins ties
            kept_value = kept_value if values else float(prices[0])
            values.append(float(prices[best]))
            alternatives[uav] = _alternatives(beam, prices, best)
            _adopt(problem, draft, uav, beam.actions[best])
        if np.array_equal(before, draft.trail):
            break
    flown = np.where(problem.state.uav_active[:, None], draft.trail, 0)
    value = values[-1] if values else 0.0
    return Plan(problem.state.slot, flown, draft.path_m, value, kept_value, tuple(alternatives))


def _draft(problem: Problem, incumbent: IntArray | None) -> _Draft:
    num_uavs, horizon = problem.scenario.num_uavs, problem.horizon_slots
    draft = _Draft(
        trail=np.full((num_uavs, horizon), NO_MOVE, dtype=np.int64),
        path_m=np.repeat(problem.state.uav_pos_enu_m[:, None, :], horizon, axis=1),
        gap_m=np.full((num_uavs, *problem.users.east_m.shape), np.inf, dtype=np.float32),
    )
    if incumbent is None:
        return draft
    kept = np.full_like(draft.trail, NO_MOVE)
    shared = min(horizon, incumbent.shape[1])
    kept[:, :shared] = incumbent[:, :shared]
    for uav in problem.planned:
        if kept[uav, 0] != NO_MOVE:
            _adopt(problem, draft, uav, kept[uav])
            draft.trail[uav] = kept[uav]  # its open end stays open for the search to fill
    return draft


def _scene(problem: Problem) -> Scene:
    return Scene(problem.users, problem.prices, problem.moves.table, problem.moves.walls, problem.effort)


def _search_one(problem: Problem, draft: _Draft, uav: int) -> Beam:
    others = np.arange(draft.trail.shape[0]) != uav
    others_gap_m = np.min(draft.gap_m[others], axis=0, initial=np.inf)
    return search(_scene(problem), problem.starts[uav], draft.trail[uav], others_gap_m)


def _prices(problem: Problem, draft: _Draft, beam: Beam, uav: int, leaf: LeafValue | None) -> FloatArray:
    """What each path of the beam costs, the time after the horizon included: [K']."""
    if leaf is None or problem.prices.end == 0.0:
        return beam.cost + beam.leaf
    flown = np.where(draft.trail == NO_MOVE, 0, draft.trail)
    after = leaf(leaf_states(problem, beam, uav, flown, draft.path_m))
    return beam.cost + problem.prices.discount**problem.horizon_slots * np.asarray(after, dtype=np.float64)


def _adopt(problem: Problem, draft: _Draft, uav: int, actions: IntArray) -> None:
    users = problem.users
    flown, path_m = follow(_scene(problem), problem.starts[uav], actions)
    east_m, north_m = path_m.astype(np.float32).T[:, :, None]
    away_m = np.hypot(users.east_m - east_m, users.north_m - north_m)
    draft.trail[uav], draft.path_m[uav] = flown, path_m
    draft.gap_m[uav] = np.maximum(away_m - np.float32(users.radius_m), np.float32(0.0))


def _alternatives(beam: Beam, prices: FloatArray, best: int) -> tuple[Alternative, ...]:
    """The best of each other first move, best first."""
    found: dict[int, float] = {}
    for index in np.argsort(prices, kind="stable"):
        action = int(beam.actions[index, 0])
        if action != beam.actions[best, 0] and action not in found and len(found) < ALTERNATIVES:
            found[action] = float(prices[index])
    return tuple(Alternative(action, value) for action, value in found.items())
