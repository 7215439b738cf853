"""Plans for all UAVs: one after the other, each with the others' plans held fixed, for several rounds.

All plans share one price, so a UAV's new plan is taken only when the whole fleet is better off, and each slot starts
from the plans kept from the slot before: plans never get worse while users' places do not surprise. One UAV at a
time gets stuck where two would have to change together, so a slot also tries what comes of throwing one UAV's plan
away: the others close the gap first, then it is planned anew. Linear in U, where joint actions cost A^U. Every
candidate is polished (``policy.search.polish``) before plans are compared.
"""

import math
from dataclasses import dataclass

import numpy as np

from policy.search.kernel import (
    NO_MOVE,
    Beam,
    Draft,
    Rounds,
    Scene,
    Trail,
    adopt,
    follow,
    gaps_m,
    plan_rounds,
    search,
)
from policy.search.leaf import LeafValue, leaf_states
from policy.search.plan import Alternative, Kept, Plan
from policy.search.polish import Legs, Paths, cruise, joint_price, keep_up, polish, ways_j
from policy.search.problem import Problem
from policy.world.actions import ActionSet
from policy.world.arrays import FloatArray, IntArray
from policy.world.frames import heading_rad
from policy.world.scenario import Scenario
from policy.world.state import JointAction

ALTERNATIVES = 3


@dataclass(frozen=True)
class _Candidate:
    """Polished plans with their price, and what was found on the way."""

    draft: Draft
    value: float
    rounds: Rounds


def make_plan(problem: Problem, incumbent: Kept | None = None, leaf: LeafValue | None = None) -> Plan:
    """The best joint plan found. ``incumbent``: kept plans (``Plan.shifted``), None at the start."""
    order = problem.planned
    best = first = _improve(problem, _draft(problem, incumbent), order, leaf)
    for uav in _rebuilt(problem, order):
        others = order[order != uav]
        other = _improve(problem, _without(problem, best.draft, uav), np.append(others, uav), leaf)
        best = other if other.value < best.value else best
    return _finished(problem, best, None if incumbent is None or order.size == 0 else first.rounds.kept_price)


def final_beam(problem: Problem, plan: Plan, uav: int) -> Beam:
    """The last layer of one more search for ``uav`` with the others on ``plan``: for learners and for inspection."""
    return _search_one(problem, _draft(problem, plan.shifted(0)), uav)


def _rebuilt(problem: Problem, order: IntArray) -> list[int]:
    """Which UAVs' plans are thrown away in this slot: all take their turns."""
    if len(order) < 2:
        return []
    count = min(problem.settings.rebuilds, len(order))
    return [int(order[(problem.state.slot * count + index) % len(order)]) for index in range(count)]


def _improve(problem: Problem, draft: Draft, order: IntArray, leaf: LeafValue | None) -> _Candidate:
    """Rounds over the UAVs in ``order`` until none changes its plan, then polish. The draft becomes the candidate's."""
    if leaf is None or problem.prices.end == 0.0:
        rounds = plan_rounds(_scene(problem), problem.starts, draft, order, problem.settings.rounds)
    else:
        rounds = _rounds_by(leaf, problem, draft, order)
    _polish(problem, draft)
    return _Candidate(draft, _value(problem, draft, leaf), rounds)


def _rounds_by(leaf: LeafValue, problem: Problem, draft: Draft, order: IntArray) -> Rounds:
    """``plan_rounds`` with another price for what comes after the horizon, which machine code cannot ask for."""
    num_uavs, beam_size = problem.scenario.num_uavs, problem.settings.beam
    price = np.full((num_uavs, beam_size), np.nan)
    action, best = np.zeros((num_uavs, beam_size), np.int64), np.zeros(num_uavs, np.int64)
    kept_price, settled = math.nan, 0
    for turn in range(problem.settings.rounds * order.size):
        if settled == order.size:
            break
        uav = int(order[turn % order.size])
        beam = _search_one(problem, draft, uav)
        flown = np.where(draft.actions == NO_MOVE, 0, draft.actions)
        after = leaf(leaf_states(problem, beam, uav, flown, draft.path_m))
        prices = beam.cost + problem.prices.discount**problem.horizon_slots * np.asarray(after, dtype=np.float64)
        best[uav] = np.argmin(prices)
        kept_price = float(prices[0]) if turn == 0 else kept_price
        price[uav], price[uav, : prices.size], action[uav, : prices.size] = math.nan, prices, beam.actions[:, 0]
        stays = adopt(_scene(problem), draft, uav, beam.actions[best[uav]], beam.path_m[best[uav]])
        settled = settled + 1 if stays else 1
    return Rounds(kept_price, price, action, best)


def _finished(problem: Problem, found: _Candidate, kept_value: float | None) -> Plan:
    state, draft = problem.state, found.draft
    actions = np.where(state.uav_active[:, None], draft.actions, 0)
    path_m = np.where(state.uav_active[:, None, None], draft.path_m, state.uav_pos_enu_m[:, None])
    vel_mps = np.where(state.uav_active[:, None, None], draft.vel_mps, 0.0)
    return Plan(
        slot=state.slot,
        actions=actions,
        path_enu_m=path_m,
        vel_enu_mps=vel_mps,
        first_action=_first_action(problem, actions, path_m, vel_mps),
        value=found.value,
        kept_value=kept_value,
        alternatives=tuple(
            _alternatives(problem.moves.actions, found.rounds, uav) for uav in range(problem.scenario.num_uavs)
        ),
    )


def _first_action(problem: Problem, actions: IntArray, path_m: FloatArray, vel_mps: FloatArray) -> JointAction:
    """The commands of the table, or, where places are free, those that fly the first leg."""
    table, first, scenario = problem.moves.table, actions[:, 0], problem.scenario
    if not problem.is_polished:
        return problem.moves.command(first)
    if math.isinf(scenario.max_accel_mps2):
        vel = (path_m[:, 0] - problem.state.uav_pos_enu_m) / scenario.slot_s
        return JointAction(heading_rad(vel), np.minimum(np.hypot(vel[:, 0], vel[:, 1]), scenario.max_speed_mps))
    vel, end = table.vel_mps[first], table.end_mps[first]
    for uav in problem.planned:
        ends = problem.start_m[uav], problem.start_mps[uav], path_m[uav, 0], vel_mps[uav, 0]
        east, north, found = cruise(_legs(scenario), *(_pair(place) for place in ends))
        if found:  # else the table's command, by which the search came here
            vel[uav], end[uav] = (east, north), vel_mps[uav, 0]
    speed_mps, end_mps = (np.minimum(np.hypot(v[:, 0], v[:, 1]), scenario.max_speed_mps) for v in (vel, end))
    return JointAction(heading_rad(vel), speed_mps, heading_rad(end), end_mps)


def _pair(vector: FloatArray) -> tuple[float, float]:
    return float(vector[0]), float(vector[1])


def _legs(scenario: Scenario) -> Legs:
    return Legs(float(scenario.slot_s), float(scenario.max_speed_mps), float(scenario.max_accel_mps2))


def _value(problem: Problem, draft: Draft, leaf: LeafValue | None) -> float:
    """The fleet's price, all UAVs' energy included."""
    planned, actions, path_m = problem.planned, draft.actions, draft.path_m
    if not planned.size:
        return 0.0
    if problem.is_polished:
        energy_j = ways_j(_scene(problem), problem.start_m, path_m, planned)
    else:
        energy_j = np.sum([_energy_j(problem, int(uav), actions) for uav in planned], axis=0)
    cost, after, aoi = joint_price(_scene(problem), path_m, energy_j, planned)
    if leaf is None or problem.prices.end == 0.0:
        return float(cost + after)
    uav, flown = int(planned[-1]), np.where(actions == NO_MOVE, 0, actions)
    end = Beam(flown[uav, None], path_m[uav, None], np.zeros(1), np.zeros(1), aoi[None])
    learned = leaf(leaf_states(problem, end, uav, flown, path_m))
    return float(cost + problem.prices.discount**problem.horizon_slots * learned[0])


def _energy_j(problem: Problem, uav: int, actions: IntArray) -> FloatArray:
    """What one UAV's plan spends in each slot by its commands [H]."""
    start = problem.start(uav)
    before = np.concatenate(([start.allowed.shape[1]], actions[uav, :-1]))
    return np.asarray(start.energy_j[before[: actions.shape[1]], actions[uav]])


def _draft(problem: Problem, incumbent: Kept | None) -> Draft:
    num_uavs, horizon = problem.scenario.num_uavs, problem.horizon_slots
    draft = Draft(
        actions=np.full((num_uavs, horizon), NO_MOVE, dtype=np.int64),
        path_m=np.repeat(problem.start_m[:, None, :], horizon, axis=1),
        vel_mps=np.zeros((num_uavs, horizon, 2)),
        length=np.zeros(num_uavs, dtype=np.int64),
        gap_m=np.full((num_uavs, *problem.users.east_m.shape), np.inf, dtype=np.float32),
    )
    if incumbent is not None:
        for uav in problem.planned:
            _take_up(problem, draft, incumbent, int(uav))
    return draft


def _without(problem: Problem, draft: Draft, uav: int) -> Draft:
    """A copy with one UAV's plan thrown away."""
    copy = Draft(
        draft.actions.copy(), draft.path_m.copy(), draft.vel_mps.copy(), draft.length.copy(), draft.gap_m.copy()
    )
    copy.actions[uav], copy.path_m[uav], copy.vel_mps[uav] = NO_MOVE, problem.start_m[uav], 0.0
    copy.length[uav], copy.gap_m[uav] = 0, np.inf
    return copy


def _scene(problem: Problem) -> Scene:
    return Scene(problem.users, problem.prices, problem.moves.table, problem.moves.walls, problem.effort)


def _take_up(problem: Problem, draft: Draft, kept: Kept, uav: int) -> None:
    """Put one kept plan into the draft as far as it can still be flown."""
    horizon = problem.horizon_slots
    actions = kept.actions[uav, :horizon]
    length = int(np.argmax(np.append(actions, NO_MOVE) == NO_MOVE))
    if length == 0:
        return
    padded = np.concatenate((actions[:length], np.full(horizon - length, NO_MOVE, dtype=np.int64)))
    if problem.is_polished:
        path_m, vel_mps = draft.path_m[uav].copy(), draft.vel_mps[uav].copy()
        path_m[:length], vel_mps[:length] = kept.path_enu_m[uav, :length], kept.vel_enu_mps[uav, :length]
        now = problem.start_m[uav], problem.start_mps[uav]
        length = keep_up(problem.moves.walls, _legs(problem.scenario), *now, path_m, vel_mps, length)
        path_m[length:] = path_m[length - 1] if length else problem.state.uav_pos_enu_m[uav]
        padded[length:] = NO_MOVE
        flown = np.where(padded == NO_MOVE, 0, padded)
    else:
        flown, path_m = follow(_scene(problem), problem.start(uav), padded)
        vel_mps = problem.moves.table.end_mps[flown]
    draft.actions[uav], draft.path_m[uav], draft.vel_mps[uav] = flown, path_m, vel_mps
    draft.length[uav] = length  # its open end stays open for the search to fill
    draft.gap_m[uav] = gaps_m(problem.users, path_m)


def _search_one(problem: Problem, draft: Draft, uav: int) -> Beam:
    others = np.arange(draft.length.size) != uav
    others_gap_m = np.min(draft.gap_m[others], axis=0, initial=np.inf)
    trail = Trail(draft.path_m[uav], draft.vel_mps[uav], draft.actions[uav], int(draft.length[uav]))
    return search(_scene(problem), problem.start(uav), trail, others_gap_m)


def _polish(problem: Problem, draft: Draft) -> None:
    """Places between the moves, and the commands nearest to the ways between them."""
    if not problem.is_polished or problem.users.aoi_slots.size == 0:
        return
    paths = Paths(problem.start_m, problem.start_mps, draft.path_m, draft.vel_mps)
    legs = _legs(problem.scenario)
    polish(_scene(problem), paths, draft.gap_m, problem.planned, legs, problem.settings.polish_sweeps)


def _alternatives(actions: ActionSet, found: Rounds, uav: int) -> tuple[Alternative, ...]:
    """The best of each other first command, best first; moves that only end differently are one."""
    others: dict[tuple[float, float], Alternative] = {}
    prices, first = found.price[uav].tolist(), found.action[uav].tolist()
    flown = _command(actions, first[found.best[uav]])
    for price, action in sorted(pair for pair in zip(prices, first, strict=True) if not math.isnan(pair[0])):
        command = _command(actions, action)
        if command != flown and command not in others and len(others) < ALTERNATIVES:
            others[command] = Alternative(action, price)
    return tuple(others.values())


def _command(actions: ActionSet, action: int) -> tuple[float, float]:
    return float(actions.heading_rad[action]), float(actions.speed_mps[action])
