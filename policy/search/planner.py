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

from policy.search.alternatives import Considered
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
from policy.search.plan import Kept, Plan
from policy.search.polish import Heat, Legs, Paths, cruise, joint_price, polish_and_price, take_up
from policy.search.problem import Float32Array, Problem
from policy.world.arrays import FloatArray, IntArray
from policy.world.frames import heading_rad
from policy.world.state import JointAction

HEAT_SHARE = 7e-4
"""Of the horizon's price at the present ages: the temperature at which heated polishing begins."""
COOLED = 0.1
"""Of that, at its last sweep; then come some without heat."""
COLD_SWEEPS = 4


@dataclass(frozen=True)
class _Candidate:
    """Polished plans with their price, and what was found on the way."""

    draft: Draft
    value: float
    rounds: Rounds


@dataclass(frozen=True)
class _Task:
    """A slot's question as compiled code reads it, put together once."""

    problem: Problem
    scene: Scene
    legs: Legs
    order: IntArray  # UAVs that fly
    leaf: LeafValue | None  # None: the closed form

    @classmethod
    def of(cls, problem: Problem, leaf: LeafValue | None = None) -> "_Task":
        """Where the campaign ends with the horizon nothing comes after it."""
        moves, scenario = problem.moves, problem.scenario
        return cls(
            problem=problem,
            scene=Scene(problem.users, problem.prices, moves.table, moves.walls, problem.effort),
            legs=Legs(float(scenario.slot_s), float(scenario.max_speed_mps), float(scenario.max_accel_mps2)),
            order=problem.planned,
            leaf=None if problem.prices.end == 0.0 else leaf,
        )


def make_plan(problem: Problem, incumbent: Kept | None = None, leaf: LeafValue | None = None) -> Plan:
    """The best joint plan found. ``incumbent``: kept plans (``Plan.shifted``), None at the start."""
    task = _Task.of(problem, leaf)
    best = first = _improve(task, _draft(task, incumbent), task.order)
    flying = task.order.tolist()
    for uav in _rebuilt(problem, flying):
        others_first = np.array([*(other for other in flying if other != uav), uav], dtype=np.int64)
        other = _improve(task, _without(problem, best.draft, uav), others_first)
        best = other if other.value < best.value else best
    if problem.settings.heated_sweeps > 0 and problem.is_polished:
        best = _heated(task, best)
    return _finished(task, best, first.rounds.kept_price if flying and incumbent is not None else None)


def final_beam(problem: Problem, plan: Plan, uav: int) -> Beam:
    """The last layer of one more search for ``uav`` with the others on ``plan``: for learners and for inspection."""
    task = _Task.of(problem)
    return _search_one(task, _draft(task, plan.shifted(0)), uav)


def _rebuilt(problem: Problem, flying: list[int]) -> list[int]:
    """Which UAVs' plans are thrown away in this slot: all take their turns."""
    if len(flying) < 2:
        return []
    count = min(problem.settings.rebuilds, len(flying))
    return [flying[(problem.state.slot * count + index) % len(flying)] for index in range(count)]


def _heated(task: _Task, best: _Candidate) -> _Candidate:
    """The better of a candidate and what heated polishing makes of it; one draw of chance for each slot."""
    problem, draft = task.problem, _copy(best.draft)
    first_slots = HEAT_SHARE * problem.horizon_slots * float(problem.users.weight @ problem.users.aoi_slots)
    cooling = np.geomspace(1.0, COOLED, problem.settings.heated_sweeps)
    heat = Heat(np.concatenate((first_slots * cooling, np.zeros(COLD_SWEEPS))), problem.state.slot)
    value = _polished_value(task, draft, heat)
    return _Candidate(draft, value, best.rounds) if value < best.value else best


def _improve(task: _Task, draft: Draft, order: IntArray) -> _Candidate:
    """Rounds over the UAVs in ``order`` until none changes its plan, then polish. The draft becomes the candidate's."""
    if task.leaf is None:
        rounds = plan_rounds(task.scene, task.problem.starts, draft, order, task.problem.settings.rounds)
    else:
        rounds = _rounds_by(task.leaf, task, draft, order)
    cold = Heat(np.zeros(task.problem.settings.polish_sweeps), 0)
    return _Candidate(draft, _polished_value(task, draft, cold), rounds)


def _rounds_by(leaf: LeafValue, task: _Task, draft: Draft, order: IntArray) -> Rounds:
    """``plan_rounds`` with another price for what comes after the horizon, which machine code cannot ask for."""
    problem = task.problem
    num_uavs, beam_size = problem.scenario.num_uavs, problem.settings.beam
    price = np.full((num_uavs, beam_size), np.nan)
    action, best = np.zeros((num_uavs, beam_size), np.int64), np.zeros(num_uavs, np.int64)
    kept_price, settled = math.nan, 0
    for turn in range(problem.settings.rounds * order.size):
        if settled == order.size:
            break
        uav = int(order[turn % order.size])
        beam = _search_one(task, draft, uav)
        flown = np.where(draft.actions == NO_MOVE, 0, draft.actions)
        after = leaf(leaf_states(problem, beam, uav, flown, draft.path_m))
        prices = beam.cost + problem.prices.discount**problem.horizon_slots * np.asarray(after, dtype=np.float64)
        best[uav] = np.argmin(prices)
        kept_price = float(prices[0]) if turn == 0 else kept_price
        price[uav], price[uav, : prices.size], action[uav, : prices.size] = math.nan, prices, beam.actions[:, 0]
        stays = adopt(task.scene, draft, uav, beam.actions[best[uav]], beam.path_m[best[uav]])
        settled = settled + 1 if stays else 1
    return Rounds(kept_price, price, action, best)


def _finished(task: _Task, found: _Candidate, kept_value: float | None) -> Plan:
    draft = found.draft
    actions = np.maximum(draft.actions, 0)  # who does not fly has no moves, and hovers in place
    return Plan(
        slot=task.problem.state.slot,
        actions=actions,
        path_enu_m=draft.path_m,
        vel_enu_mps=draft.vel_mps,
        first_action=_first_action(task, actions, draft.path_m, draft.vel_mps),
        value=found.value,
        kept_value=kept_value,
        considered=Considered(task.problem.moves.actions, found.rounds),
    )


def _first_action(task: _Task, actions: IntArray, path_m: FloatArray, vel_mps: FloatArray) -> JointAction:
    """The commands of the table, or, where places are free, those that fly the first leg."""
    problem = task.problem
    table, first, scenario = problem.moves.table, actions[:, 0], problem.scenario
    if not problem.is_polished:
        return problem.moves.command(first)
    if math.isinf(scenario.max_accel_mps2):
        vel = (path_m[:, 0] - problem.state.uav_pos_enu_m) / scenario.slot_s
        return JointAction(heading_rad(vel), np.minimum(np.hypot(vel[:, 0], vel[:, 1]), scenario.max_speed_mps))
    vel, end = table.vel_mps[first], table.end_mps[first]
    for uav in task.order:
        ends = problem.start_m[uav], problem.start_mps[uav], path_m[uav, 0], vel_mps[uav, 0]
        east, north, found = cruise(task.legs, *(_pair(place) for place in ends))
        if found:  # else the table's command, by which the search came here
            vel[uav], end[uav] = (east, north), vel_mps[uav, 0]
    speed_mps, end_mps = (np.minimum(np.hypot(v[:, 0], v[:, 1]), scenario.max_speed_mps) for v in (vel, end))
    return JointAction(heading_rad(vel), speed_mps, heading_rad(end), end_mps)


def _pair(vector: FloatArray) -> tuple[float, float]:
    return float(vector[0]), float(vector[1])


def _polished_value(task: _Task, draft: Draft, heat: Heat) -> float:
    """The fleet's price, all UAVs' energy included, once the draft's places lie between the moves where they may."""
    problem, order = task.problem, task.order
    if not order.size:
        return 0.0
    if problem.is_polished:
        paths = Paths(problem.start_m, problem.start_mps, draft.path_m, draft.vel_mps)
        cost, after, aoi = polish_and_price(task.scene, paths, draft.gap_m, order, task.legs, heat)
    else:
        energy_j = np.sum([_energy_j(problem, int(uav), draft.actions) for uav in order], axis=0)
        cost, after, aoi = joint_price(task.scene, draft.path_m, energy_j, order)
    return float(cost + (after if task.leaf is None else _learned_after(task.leaf, task, draft, aoi)))


def _learned_after(leaf: LeafValue, task: _Task, draft: Draft, aoi_slots: Float32Array) -> float:
    """The price of what comes after plans that leave users at ages [N]."""
    problem, uav = task.problem, int(task.order[-1])
    flown = np.where(draft.actions == NO_MOVE, 0, draft.actions)
    end = Beam(flown[uav, None], draft.path_m[uav, None], np.zeros(1), np.zeros(1), aoi_slots[None])
    learned = leaf(leaf_states(problem, end, uav, flown, draft.path_m))
    return float(problem.prices.discount**problem.horizon_slots * learned[0])


def _energy_j(problem: Problem, uav: int, actions: IntArray) -> FloatArray:
    """What one UAV's plan spends in each slot by its commands [H]."""
    start = problem.start(uav)
    before = np.concatenate(([start.allowed.shape[1]], actions[uav, :-1]))
    return np.asarray(start.energy_j[before[: actions.shape[1]], actions[uav]])


def _draft(task: _Task, incumbent: Kept | None) -> Draft:
    """Nothing planned, but for what is kept and can still be flown."""
    problem = task.problem
    num_uavs, horizon = problem.scenario.num_uavs, problem.horizon_slots
    draft = Draft(
        actions=np.full((num_uavs, horizon), NO_MOVE, dtype=np.int64),
        path_m=np.repeat(problem.start_m[:, None, :], horizon, axis=1),
        vel_mps=np.zeros((num_uavs, horizon, 2)),
        length=np.zeros(num_uavs, dtype=np.int64),
        gap_m=np.full((num_uavs, *problem.users.east_m.shape), np.inf, dtype=np.float32),
    )
    if incumbent is None:
        return draft
    if problem.is_polished:
        kept = incumbent.actions, incumbent.path_enu_m, incumbent.vel_enu_mps
        take_up(task.scene, (problem.start_m, problem.start_mps), kept, draft, task.order, task.legs)
    else:
        for uav in task.order:
            _follow(task, draft, incumbent.actions[uav, :horizon], int(uav))
    return draft


def _without(problem: Problem, draft: Draft, uav: int) -> Draft:
    """A copy with one UAV's plan thrown away."""
    copy = _copy(draft)
    copy.actions[uav], copy.path_m[uav], copy.vel_mps[uav] = NO_MOVE, problem.start_m[uav], 0.0
    copy.length[uav], copy.gap_m[uav] = 0, np.inf
    return copy


def _copy(draft: Draft) -> Draft:
    return Draft(
        draft.actions.copy(), draft.path_m.copy(), draft.vel_mps.copy(), draft.length.copy(), draft.gap_m.copy()
    )


def _follow(task: _Task, draft: Draft, actions: IntArray, uav: int) -> None:
    """Put one kept plan by the table's commands [<= H] into the draft as far as it can still be flown."""
    horizon = task.problem.horizon_slots
    length = int(np.argmax(np.append(actions, NO_MOVE) == NO_MOVE))
    if length == 0:
        return
    padded = np.concatenate((actions[:length], np.full(horizon - length, NO_MOVE, dtype=np.int64)))
    flown, path_m = follow(task.scene, task.problem.start(uav), padded)
    draft.actions[uav], draft.path_m[uav] = flown, path_m
    draft.vel_mps[uav] = task.scene.table.end_mps[flown]
    draft.length[uav] = length  # its open end stays open for the search to fill
    draft.gap_m[uav] = gaps_m(task.scene.users, path_m)


def _search_one(task: _Task, draft: Draft, uav: int) -> Beam:
    others = np.arange(draft.length.size) != uav
    others_gap_m = np.min(draft.gap_m[others], axis=0, initial=np.inf)
    trail = Trail(draft.path_m[uav], draft.vel_mps[uav], draft.actions[uav], int(draft.length[uav]))
    return search(task.scene, task.problem.start(uav), trail, others_gap_m)
