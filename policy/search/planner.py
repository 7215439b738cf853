"""Plans for all UAVs: one after the other, each with the others' plans held fixed, for several rounds.

All plans share one price, so a UAV's new plan is taken only when the whole fleet is better off, and each round
starts from the plan kept from the slot before: the plan never gets worse while the users' places do not surprise.
Linear in U, where choosing among joint actions costs A^U.
"""

from dataclasses import dataclass

import numpy as np

from policy.search.kernel import NO_MOVE, Beam, Start, follow, search
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
    draft = _draft(problem, incumbent)
    value, kept_value = np.inf, np.inf
    alternatives: list[tuple[Alternative, ...]] = [()] * problem.scenario.num_uavs
    for turn in range(problem.settings.rounds):
        changed = False
        for uav in problem.planned:
            beam = _search_one(problem, draft, uav)
            prices = _prices(problem, draft, beam, uav, leaf)
            best = int(np.argmin(prices))  # the kept plan comes first and wins ties
            changed = changed or not np.array_equal(beam.actions[best], draft.trail[uav])
            value = float(prices[best])
            kept_value = kept_value if np.isfinite(kept_value) else float(prices[0])
            alternatives[uav] = _alternatives(beam, prices, best)
            _adopt(problem, draft, uav, beam.actions[best])
        if not changed:
            break
    return Plan(
        slot=problem.state.slot,
        actions=np.where(problem.state.uav_active[:, None], draft.trail, 0),
        path_enu_m=draft.path_m,
        value=value if np.isfinite(value) else 0.0,
        kept_value=kept_value if np.isfinite(kept_value) else 0.0,
        alternatives=tuple(alternatives),
    )


def final_beam(problem: Problem, plan: Plan, uav: int) -> Beam:
    """The last layer of one more search for ``uav`` with the others on ``plan``: for learners and for inspection."""
    return _search_one(problem, _draft(problem, plan.actions), uav)


def _draft(problem: Problem, incumbent: IntArray | None) -> _Draft:
    num_uavs, horizon = problem.scenario.num_uavs, problem.horizon_slots
    draft = _Draft(
        trail=np.full((num_uavs, horizon), NO_MOVE, dtype=np.int64),
        path_m=np.repeat(problem.state.uav_pos_enu_m[:, None, :], horizon, axis=1),
        gap_m=np.full((num_uavs, *problem.users.east_m.shape), np.inf, dtype=np.float32),
    )
    if incumbent is not None:
        shared = min(horizon, incumbent.shape[1])
        draft.trail[:, :shared] = incumbent[:, :shared]
        for uav in problem.planned:
            kept = draft.trail[uav].copy()
            _adopt(problem, draft, uav, kept)
            draft.trail[uav] = kept  # its open end stays open for the search to fill
    return draft


def _search_one(problem: Problem, draft: _Draft, uav: int) -> Beam:
    others = np.arange(draft.trail.shape[0]) != uav
    others_gap_m = np.min(draft.gap_m[others], axis=0, initial=np.inf)
    settings, moves = problem.settings, problem.moves
    return search(
        _start(problem, uav),
        draft.trail[uav],
        others_gap_m,
        problem.users,
        problem.prices,
        moves.table,
        moves.walls,
        settings.beam,
        settings.cell_m,
    )


def _start(problem: Problem, uav: int) -> Start:
    return Start(
        problem.state.uav_pos_enu_m[uav],
        problem.first_step_m[uav],
        problem.first_energy_j[uav],
        problem.first_allowed[uav],
    )


def _prices(problem: Problem, draft: _Draft, beam: Beam, uav: int, leaf: LeafValue | None) -> FloatArray:
    """What each path of the beam costs, the time after the horizon included: [K']."""
    if leaf is None or problem.prices.end == 0.0:
        return beam.cost + beam.leaf
    flown = np.where(draft.trail == NO_MOVE, 0, draft.trail)
    after = leaf(leaf_states(problem, beam, uav, flown, draft.path_m))
    return beam.cost + problem.prices.discount**problem.horizon_slots * np.asarray(after, dtype=np.float64)


def _adopt(problem: Problem, draft: _Draft, uav: int, actions: IntArray) -> None:
    moves, users = problem.moves, problem.users
    flown, path_m = follow(_start(problem, uav), actions, moves.table, moves.walls)
    away_m = np.hypot(users.east_m - path_m[:, :1].astype(np.float32), users.north_m - path_m[:, 1:].astype(np.float32))
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
