"""Plans for all UAVs: one after the other, each with the others' plans held fixed, for several rounds.

All plans share one price, so a UAV's new plan is taken only when the whole fleet is better off, and each slot starts
from the plans kept from the slot before: plans never get worse while users' places do not surprise. One UAV at a
time gets stuck where two would have to change together, so a slot also tries what comes of throwing one UAV's plan
away: the others close the gap first, then it is planned anew. Linear in U, where joint actions cost A^U. Every
candidate is polished (``policy.search.polish``) before plans are compared.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from policy.search.kernel import NO_MOVE, Beam, Scene, Trail, follow, gaps_m, search
from policy.search.leaf import LeafValue, leaf_states
from policy.search.plan import Alternative, Kept, Plan
from policy.search.polish import Legs, Paths, cruise, joint_price, keep_up, polish, ways_j
from policy.search.problem import Float32Array, Problem
from policy.world.arrays import FloatArray, IntArray
from policy.world.frames import heading_rad
from policy.world.scenario import Scenario
from policy.world.state import JointAction

ALTERNATIVES = 3


@dataclass
class _Draft:
    """The plans so far. ``gap_m`` [U, H, N] metres from where each UAV serves to each user; infinite: no plan."""

    actions: IntArray  # [U, H]
    path_m: FloatArray  # [U, H, 2]
    vel_mps: FloatArray  # [U, H, 2] at the end of each slot
    length: IntArray  # [U] slots planned; the rest is open
    gap_m: Float32Array

    def trail(self, uav: int) -> Trail:
        """One UAV's plan as the kernel keeps it."""
        return Trail(self.path_m[uav], self.vel_mps[uav], self.actions[uav], int(self.length[uav]))


def make_plan(problem: Problem, incumbent: Kept | None = None, leaf: LeafValue | None = None) -> Plan:
    """The best joint plan found. ``incumbent``: kept plans (``Plan.shifted``), None at the start."""
    order = [int(uav) for uav in problem.planned]
    best = _improve(problem, incumbent, order, leaf)
    kept_value = None if incumbent is None else best.kept_value
    for uav in _rebuilt(problem, order):
        other = _improve(problem, best.shifted(0).without(uav), [u for u in order if u != uav] + [uav], leaf)
        best = other if other.value < best.value else best
    return replace(best, kept_value=kept_value)


def final_beam(problem: Problem, plan: Plan, uav: int) -> Beam:
    """The last layer of one more search for ``uav`` with the others on ``plan``: for learners and for inspection."""
    return _search_one(problem, _draft(problem, plan.shifted(0)), uav)


def _rebuilt(problem: Problem, order: list[int]) -> list[int]:
    """Which UAVs' plans are thrown away in this slot: all take their turns."""
    if len(order) < 2:
        return []
    count = min(problem.settings.rebuilds, len(order))
    return [order[(problem.state.slot * count + index) % len(order)] for index in range(count)]


def _improve(problem: Problem, incumbent: Kept | None, order: list[int], leaf: LeafValue | None) -> Plan:
    """Rounds over the UAVs in ``order`` until none changes its plan, then polish."""
    draft = _draft(problem, incumbent)
    kept_value: float | None = None
    alternatives: list[tuple[Alternative, ...]] = [()] * problem.scenario.num_uavs
    settled = 0  # UAVs in a row whose plan stayed: their searches would answer the same again
    for uav in order * problem.settings.rounds:
        if settled == len(order):
            break
        beam = _search_one(problem, draft, uav)
        prices = _prices(problem, draft, beam, uav, leaf)
        best = int(np.argmin(prices))  # the kept plan comes first and wins ties
        kept_value = float(prices[0]) if kept_value is None else kept_value
        alternatives[uav] = _alternatives(beam, prices, best)
        stays = draft.length[uav] == problem.horizon_slots and np.array_equal(draft.path_m[uav], beam.path_m[best])
        settled = settled + 1 if stays else 1
        vel_mps = _velocities(problem, draft, uav, beam.actions[best], beam.path_m[best])
        _adopt(problem, draft, uav, beam.actions[best], beam.path_m[best], vel_mps)
    _polish(problem, draft)
    return _finished(problem, draft, leaf, kept_value, tuple(alternatives))


def _finished(
    problem: Problem,
    draft: _Draft,
    leaf: LeafValue | None,
    kept_value: float | None,
    alternatives: tuple[tuple[Alternative, ...], ...],
) -> Plan:
    state, planned = problem.state, problem.planned
    actions = np.where(state.uav_active[:, None], draft.actions, 0)
    path_m = np.where(state.uav_active[:, None, None], draft.path_m, state.uav_pos_enu_m[:, None])
    vel_mps = np.where(state.uav_active[:, None, None], draft.vel_mps, 0.0)
    return Plan(
        slot=state.slot,
        actions=actions,
        path_enu_m=path_m,
        vel_enu_mps=vel_mps,
        first_action=_first_action(problem, actions, path_m, vel_mps),
        value=_value(problem, actions, path_m, leaf) if planned.size else 0.0,
        kept_value=kept_value,
        alternatives=alternatives,
    )


def _first_action(problem: Problem, actions: IntArray, path_m: FloatArray, vel_mps: FloatArray) -> JointAction:
    """The commands of the table, or, where places are free, those that fly the first leg."""
    table, first, scenario = problem.moves.actions, actions[:, 0], problem.scenario
    if not problem.is_polished:
        return JointAction(table.heading_rad[first], table.speed_mps[first])
    if math.isinf(scenario.max_accel_mps2):
        vel = (path_m[:, 0] - problem.state.uav_pos_enu_m) / scenario.slot_s
        return JointAction(heading_rad(vel), np.minimum(np.hypot(vel[:, 0], vel[:, 1]), scenario.max_speed_mps))
    vel, end = table.vel_enu_mps[first], table.vel_enu_mps[first].copy()
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


def _value(problem: Problem, actions: IntArray, path_m: FloatArray, leaf: LeafValue | None) -> float:
    """The fleet's price, all UAVs' energy included."""
    if problem.is_polished:
        energy_j = ways_j(_scene(problem), problem.start_m, path_m, problem.planned)
    else:
        energy_j = np.sum([_energy_j(problem, int(uav), actions) for uav in problem.planned], axis=0)
    cost, after, aoi = joint_price(_scene(problem), path_m, energy_j, problem.planned)
    if leaf is None or problem.prices.end == 0.0:
        return float(cost + after)
    uav = int(problem.planned[-1])
    end = Beam(actions[uav, None], path_m[uav, None], np.zeros(1), np.zeros(1), aoi[None])
    learned = leaf(leaf_states(problem, end, uav, actions, path_m))
    return float(cost + problem.prices.discount**problem.horizon_slots * learned[0])


def _energy_j(problem: Problem, uav: int, actions: IntArray) -> FloatArray:
    """What one UAV's plan spends in each slot by its commands [H]."""
    start = problem.starts[uav]
    before = np.concatenate(([start.allowed.shape[1]], actions[uav, :-1]))
    return np.asarray(start.energy_j[before[: actions.shape[1]], actions[uav]])


def _draft(problem: Problem, incumbent: Kept | None) -> _Draft:
    num_uavs, horizon = problem.scenario.num_uavs, problem.horizon_slots
    draft = _Draft(
        actions=np.full((num_uavs, horizon), NO_MOVE, dtype=np.int64),
        path_m=np.repeat(np.asarray(problem.state.uav_pos_enu_m, dtype=np.float64)[:, None, :], horizon, axis=1),
        vel_mps=np.zeros((num_uavs, horizon, 2)),
        length=np.zeros(num_uavs, dtype=np.int64),
        gap_m=np.full((num_uavs, *problem.users.east_m.shape), np.inf, dtype=np.float32),
    )
    if incumbent is not None:
        for uav in problem.planned:
            _take_up(problem, draft, incumbent, int(uav))
    return draft


def _scene(problem: Problem) -> Scene:
    return Scene(problem.users, problem.prices, problem.moves.table, problem.moves.walls, problem.effort)


def _take_up(problem: Problem, draft: _Draft, kept: Kept, uav: int) -> None:
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
        flown, path_m = follow(_scene(problem), problem.starts[uav], padded)
        vel_mps = problem.moves.actions.vel_enu_mps[flown]
    _adopt(problem, draft, uav, flown, path_m, vel_mps)
    draft.length[uav] = length  # its open end stays open for the search to fill


def _velocities(problem: Problem, draft: _Draft, uav: int, actions: IntArray, path_m: FloatArray) -> FloatArray:
    """At the ends of a found path's slots [H, 2]: the kept path's as far as it is that, then the commands'."""
    vel = problem.moves.actions.vel_enu_mps[actions]
    if math.isinf(problem.scenario.max_accel_mps2):
        return vel
    on_trail = np.all(path_m == draft.path_m[uav], axis=-1) & (np.arange(len(actions)) < draft.length[uav])
    return np.where(np.logical_and.accumulate(on_trail)[:, None], draft.vel_mps[uav], vel)


def _search_one(problem: Problem, draft: _Draft, uav: int) -> Beam:
    others = np.arange(draft.length.size) != uav
    others_gap_m = np.min(draft.gap_m[others], axis=0, initial=np.inf)
    return search(_scene(problem), problem.starts[uav], draft.trail(uav), others_gap_m)


def _prices(problem: Problem, draft: _Draft, beam: Beam, uav: int, leaf: LeafValue | None) -> FloatArray:
    """What each path of the beam costs, the time after the horizon included: [K']."""
    if leaf is None or problem.prices.end == 0.0:
        return beam.cost + beam.leaf
    flown = np.where(draft.actions == NO_MOVE, 0, draft.actions)
    after = leaf(leaf_states(problem, beam, uav, flown, draft.path_m))
    return beam.cost + problem.prices.discount**problem.horizon_slots * np.asarray(after, dtype=np.float64)


def _adopt(
    problem: Problem, draft: _Draft, uav: int, actions: IntArray, path_m: FloatArray, vel_mps: FloatArray
) -> None:
    draft.actions[uav], draft.path_m[uav], draft.vel_mps[uav] = actions, path_m, vel_mps
    draft.length[uav] = problem.horizon_slots
    draft.gap_m[uav] = gaps_m(problem.users, path_m)


def _polish(problem: Problem, draft: _Draft) -> None:
    """Places between the moves, and the commands nearest to the ways between them."""
    if not problem.is_polished or problem.users.aoi_slots.size == 0:
        return
    paths = Paths(problem.start_m, problem.start_mps, draft.path_m, draft.vel_mps)
    polish(_scene(problem), paths, problem.planned, _legs(problem.scenario), problem.settings.polish_sweeps)


def _alternatives(beam: Beam, prices: FloatArray, best: int) -> tuple[Alternative, ...]:
    """The best of each other first move, best first."""
    found: dict[int, float] = {}
    for index in np.argsort(prices, kind="stable"):
        action = int(beam.actions[index, 0])
        if action != beam.actions[best, 0] and action not in found and len(found) < ALTERNATIVES:
            found[action] = float(prices[index])
    return tuple(Alternative(action, value) for action, value in found.items())
