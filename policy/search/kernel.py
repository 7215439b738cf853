"""The compiled beam search of one UAV over H slots, the other UAVs' paths held fixed.

A node is a place, the index of the last command (A: the present velocity) and the AoI of all users. Nodes are
ranked by the cost so far and the leaf term. Paths that have come to one cell with one AoI of every user are one
path: the better one stays. The kept path ("trail") always survives, so the search never ends worse than it.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from policy.model.compiled import compiled
from policy.search.moves import MoveTable, Walls
from policy.search.problem import VECTOR, Effort, Float32Array, Prices, Start, Users
from policy.world import motion
from policy.world.arrays import BoolArray, FloatArray, IntArray

NO_MOVE = -1
ONE = np.float32(1.0)
ZERO = np.float32(0.0)
HALF = np.float32(0.5)
BINS = 256
LEAST_RANGE = 1e-9  # of ranks, for bins to tell them apart
SHORTLIST = 3  # candidates looked at for each one kept; the rest are duplicates
SPARE = 8  # candidates beside those kept that are sorted at first: duplicates are few
CELLS = 2**20  # more than there are along an area, or velocities
SAME_M = 1e-6  # places that differ by less are one, reached in another order of moves
REVERSAL_RAD, SLOW_SHARE, STRAIGHT_RAD, TINY = motion.REVERSAL_RAD, motion.SLOW_SHARE, motion.STRAIGHT_RAD, motion.TINY
SLACK_M = np.float32(0.01)  # more than float32 rounds distances by


class Scene(NamedTuple):
    """What all UAVs' searches of one slot share."""

    users: Users
    prices: Prices
    table: MoveTable
    walls: Walls
    effort: Effort


class Trail(NamedTuple):
    """A path to keep, open from ``length`` on. Places and velocities need not be ones that the moves lead to."""

    path_m: FloatArray  # [H, 2]
    vel_mps: FloatArray  # [H, 2] at the end of each slot; means nothing with the paper's motion
    action: IntArray  # [H] the command nearest to it
    length: int


class Beam(NamedTuple):
    """The K' <= K paths left at the horizon's end; the trail's, where there is one, is the first."""

    actions: IntArray  # [K', H]
    path_m: FloatArray  # [K', H, 2]
    cost: FloatArray  # [K'] discounted, without what comes after the horizon
    leaf: FloatArray  # [K'] the closed-form cost of what comes after
    aoi_slots: Float32Array  # [K', N] of all users the kernel reads


class Draft(NamedTuple):
    """The plans of U UAVs so far, changed in place."""

    actions: IntArray  # [U, H]
    path_m: FloatArray  # [U, H, 2]
    vel_mps: FloatArray  # [U, H, 2] at the end of each slot
    length: IntArray  # [U] slots planned; the rest is open
    gap_m: Float32Array  # [U, H, N] metres from where each UAV serves for sure to each user; infinite: no plan


class Rounds(NamedTuple):
    """What was found on the way, for explaining: of each UAV's last search."""

    kept_price: float  # of the first UAV's kept path, completed as well as can be
    price: FloatArray  # [U, K] of its paths; NaN: no path
    action: IntArray  # [U, K] with which they begin
    best: IntArray  # [U] which was taken


class Layer(NamedTuple):
    """Nodes of one depth, the first ``size`` of K; N as in :class:`policy.search.problem.Users`."""

    size: int
    parent: IntArray  # [K] place in the layer before
    last: IntArray  # [K] the command that led here
    pos_m: FloatArray  # [K, 2]
    cost: FloatArray  # [K]
    leaf: FloatArray  # [K]
    aoi_slots: Float32Array  # [K, N]


class Children(NamedTuple):
    """K A children in order of node and action, then the trail's."""

    rank: FloatArray  # [K A + 1] cost and leaf; infinite: not legal
    spent_j: FloatArray  # [K A + 1]
    pos_m: FloatArray  # [K A + 1, 2]


class Slot(NamedTuple):
    """One depth of a search."""

    depth: int
    discount: float
    age_price: np.float32  # of a slot of everyone's age
    leaf_price: np.float32  # the same and a metre to go, in the leaf
    cover_price: np.float32  # of a user missed


class Near(NamedTuple):
    """Users whom a depth concerns: to the others another UAV is nearer, wherever this one goes. Written anew at each
    depth.
    """

    who: npt.NDArray[np.uint32]  # [N] the first of it
    crowd: Float32Array  # [6, N] their part of it, then users who cost nothing
    waiting: Float32Array  # [2, N] their weighted AoI, of two nodes
    apart: Float32Array  # [N] what a slot of age of each of the others costs
    twin: IntArray  # [K] another node at the same place, or the node itself


EAST, NORTH, INNER, FADE, OTHERS, WEIGHT = range(6)
"""Rows of a crowd, float32 [6, N]: the users at the end of one slot, in one array so that the loops over users run
on vector units. OTHERS: metres from where the nearest other UAV serves for sure.
"""


@compiled
def search(scene: Scene, start: Start, trail: Trail, others_gap_m: Float32Array) -> Beam:
    """``others_gap_m`` [H, N]: metres from where the nearest other UAV serves for sure, 0 within."""
    users, prices, beam = scene.users, scene.prices, scene.effort.beam
    horizon, num_users = users.east_m.shape
    num_actions = start.allowed.shape[1]
    # All that is written on, once: to have it anew at each depth costs as much as many a sum.
    parents, moves = np.zeros((horizon, beam), np.int64), np.zeros((horizon, beam), np.int64)
    places, ages = np.empty((horizon, beam, 2)), np.empty((2, beam, num_users), np.float32)
    costs, leaves = np.zeros((horizon, beam)), np.zeros((horizon, beam))
    most = beam * num_actions + 1
    room = Children(np.empty(most), np.empty(most), np.empty((most, 2)))
    crowd = np.empty((6, num_users), np.float32)
    near = Near(
        np.empty(num_users, np.uint32),
        np.empty((6, num_users), np.float32),
        np.empty((2, num_users), np.float32),
        np.empty(num_users, np.float32),
        np.empty(beam, np.int64),
    )
    layer, discount, on_trail = _root(start, users), 1.0, trail.length > 0
    for depth in range(horizon):
        _gather(users, depth, others_gap_m[depth], crowd)
        slot = _slot(prices, depth, discount, horizon, users.present)
        last = layer.size * num_actions
        children = Children(room.rank[: last + 1], room.spent_j[: last + 1], room.pos_m[: last + 1])
        reach_m = _spread(scene, start, layer, trail, depth, on_trail, children)
        _rank(scene, layer, crowd, near, slot, reach_m, children)
        discount *= prices.discount
        kept_first = NO_MOVE
        if on_trail:
            kept_first = last if depth < trail.length else _best_child(children.rank, num_actions)
        on_trail = kept_first != NO_MOVE
        below = Layer(0, parents[depth], moves[depth], places[depth], costs[depth], leaves[depth], ages[depth % 2])
        layer = _chosen(scene, children, layer, crowd, slot, (kept_first, trail.action[depth]), below)
    actions, path_m = _trace(parents, moves, places, layer.size)
    kept = layer.size
    return Beam(actions, path_m, layer.cost[:kept].copy(), layer.leaf[:kept].copy(), layer.aoi_slots[:kept].copy())


@compiled
def _slot(prices: Prices, depth: int, discount: float, horizon: int, present: int) -> Slot:
    is_last = depth + 1 == horizon
    return Slot(
        depth,
        discount,
        np.float32(discount * (1.0 + (prices.last if is_last else 0.0))),
        np.float32(discount * prices.discount * (prices.end if is_last else prices.leaf)),
        np.float32(discount * prices.cover / max(present, 1)),
    )


@compiled
def plan_rounds(scene: Scene, starts: Start, draft: Draft, order: IntArray, rounds: int) -> Rounds:
    """Plan the UAVs in ``order`` one after the other, ``rounds`` times or until none changes its plan.

    ``starts``: those of all UAVs in one, each array with a leading [U]. Prices are the beam's own, with the closed form
    for what comes after the horizon.
    """
    num_uavs, beam_size = draft.length.size, scene.effort.beam
    found = Rounds(
        np.nan,
        np.full((num_uavs, beam_size), np.nan),
        np.zeros((num_uavs, beam_size), np.int64),
        np.zeros(num_uavs, np.int64),
    )
    kept_price, settled = np.nan, 0  # UAVs in a row whose plan stayed: their searches would answer the same again
    for turn in range(rounds * order.size):
        if settled == order.size:
            break
        uav = order[turn % order.size]
        others_gap_m = np.full(draft.gap_m.shape[1:], np.float32(np.inf), np.float32)
        for other in order:
            if other != uav:
                others_gap_m = np.minimum(others_gap_m, draft.gap_m[other])
        start = Start(starts.pos_m[uav], starts.step_m[uav], starts.energy_j[uav], starts.allowed[uav])
        trail = Trail(draft.path_m[uav], draft.vel_mps[uav], draft.actions[uav], draft.length[uav])
        beam = search(scene, start, trail, others_gap_m)
        prices = beam.cost + beam.leaf
        best = np.argmin(prices)  # the kept plan comes first and wins ties
        kept_price = prices[0] if turn == 0 else kept_price
        found.price[uav], found.best[uav] = np.nan, best
        found.price[uav, : prices.size], found.action[uav, : prices.size] = prices, beam.actions[:, 0]
        settled = settled + 1 if _adopt(scene, draft, uav, beam.actions[best], beam.path_m[best]) else 1
    return Rounds(kept_price, found.price, found.action, found.best)


@compiled
def adopt(scene: Scene, draft: Draft, uav: int, actions: IntArray, path_m: FloatArray) -> bool:
    """Take a found path [H, 2] for a UAV's plan; whether that is what it was."""
    return _adopt(scene, draft, uav, actions, path_m)


@compiled
def _adopt(scene: Scene, draft: Draft, uav: int, actions: IntArray, path_m: FloatArray) -> bool:
    horizon = actions.size
    stays: bool = draft.length[uav] == horizon
    on_trail = True
    for depth in range(horizon):
        is_same = path_m[depth, 0] == draft.path_m[uav, depth, 0] and path_m[depth, 1] == draft.path_m[uav, depth, 1]
        on_trail = on_trail and is_same and depth < draft.length[uav]
        stays = stays and is_same
        if not (on_trail and scene.effort.by_velocity):  # a kept path keeps its velocities, between the commands'
            draft.vel_mps[uav, depth] = scene.table.end_mps[actions[depth]]
    draft.actions[uav], draft.path_m[uav], draft.length[uav] = actions, path_m, horizon
    draft.gap_m[uav] = gaps_m(scene.users, path_m)
    return stays


@compiled
def follow(scene: Scene, start: Start, actions: IntArray) -> tuple[IntArray, FloatArray]:
    """Kept commands [H] from where the UAV really is: (actions [H], places [H, 2]); from the first move that is no
    longer possible on it brakes and hovers.
    """
    horizon = actions.shape[0]
    flown, path_m = np.zeros(horizon, np.int64), np.zeros((horizon, 2))
    east, north, last, broken = start.pos_m[0], start.pos_m[1], start.allowed.shape[1], False
    for depth in range(horizon):
        action = actions[depth]
        broken = broken or action == NO_MOVE or not _legal(scene, start, (east, north), last)[action]
        if broken:
            action = 0
        east += start.step_m[last, action, 0]
        north += start.step_m[last, action, 1]
        path_m[depth, 0], path_m[depth, 1] = east, north
        flown[depth], last = action, action
    return flown, path_m


@compiled
def gaps_m(users: Users, path_m: FloatArray) -> Float32Array:
    """Metres from where a UAV on ``path_m`` [H, 2] serves for sure to each user: [H, N], 0 within."""
    gap: Float32Array = np.zeros(users.east_m.shape, np.float32)
    for depth in range(gap.shape[0]):
        east, north = np.float32(path_m[depth, 0]), np.float32(path_m[depth, 1])
        for user in range(gap.shape[1]):
            d_east, d_north = users.east_m[depth, user] - east, users.north_m[depth, user] - north
            gap[depth, user] = max(np.sqrt(d_east * d_east + d_north * d_north) - users.inner_m[depth, user], ZERO)
    return gap


@compiled
def _root(start: Start, users: Users) -> Layer:
    aoi = users.aoi_slots.copy().reshape(1, users.aoi_slots.size)
    pos_m, last = start.pos_m.copy().reshape(1, 2), np.full(1, start.allowed.shape[1])
    return Layer(1, np.zeros(1, np.int64), last, pos_m, np.zeros(1), np.zeros(1), aoi)


@compiled
def _gather(users: Users, depth: int, others_gap_m: Float32Array, crowd: Float32Array) -> None:
    crowd[EAST], crowd[NORTH] = users.east_m[depth], users.north_m[depth]
    crowd[INNER], crowd[FADE] = users.inner_m[depth], users.fade_per_m[depth]
    crowd[OTHERS], crowd[WEIGHT] = others_gap_m, users.weight


@compiled
def _spread(
    scene: Scene, start: Start, layer: Layer, trail: Trail, depth: int, on_trail: bool, children: Children
) -> float:
    """Where all moves of all nodes lead and what they spend; the rank is 0 for those that are legal, to be filled in.
    Returns the longest way.
    """
    num_actions, legal, reach_2 = start.allowed.shape[1], np.zeros(start.allowed.shape[1], np.bool_), 0.0
    rank, spent_j, pos_m = children
    step_m, energy_j = start.step_m, start.energy_j
    for node in range(layer.size):
        place, last = (layer.pos_m[node, 0], layer.pos_m[node, 1]), layer.last[node]
        if scene.walls.box_m.shape[0] == 0 and last < num_actions:  # as _legal does, which is far dearer to call
            _keep_inside(scene, start, place, last, legal)
        else:
            legal[:] = _legal(scene, start, place, last)
        for action in range(num_actions):
            child, d_e, d_n = node * num_actions + action, step_m[last, action, 0], step_m[last, action, 1]
            rank[child], spent_j[child] = 0.0 if legal[action] else np.inf, energy_j[last, action]
            pos_m[child, 0], pos_m[child, 1] = place[0] + d_e, place[1] + d_n
            reach_2 = max(reach_2, d_e * d_e + d_n * d_n)
    is_beside = scene.effort.free_places and scene.effort.by_velocity  # the trail's velocity is none of the table's
    if is_beside and on_trail and 0 < depth <= trail.length:
        reach_2 = max(reach_2, _spread_beside(scene.table, trail.vel_mps[depth - 1], layer, children))
    child = layer.size * num_actions
    rank[child] = np.inf
    if depth < trail.length:
        east, north = trail.path_m[depth, 0], trail.path_m[depth, 1]
        rank[child], pos_m[child, 0], pos_m[child, 1] = 0.0, east, north
        spent_j[child] = energy_j[layer.last[0], trail.action[depth]]
        way_m = np.hypot(east - layer.pos_m[0, 0], north - layer.pos_m[0, 1])
        reach_2 = max(reach_2, way_m * way_m)
        if scene.effort.free_places:
            spent_j[child] = _cruise_j(scene.table, way_m)
    return float(np.sqrt(reach_2))


@compiled
def _rank(
    scene: Scene, layer: Layer, crowd: Float32Array, near: Near, slot: Slot, reach_m: float, children: Children
) -> None:
    """Fill in the ranks. Nodes at one place share the ways from there to the users."""
    num_actions, last = children.rank.size // layer.size, children.rank.size - 1
    others, count = _take_near(crowd, near, layer, slot, reach_m, scene.users.present)
    _pair_up(layer, near.twin, scene.effort.by_velocity)
    energy_price = slot.discount * scene.prices.energy
    for child in range(last + 1):
        children.rank[child] += energy_price * children.spent_j[child] + others
    for node in range(layer.size):
        twin = near.twin[node]
        if twin < node:
            continue
        first = node * num_actions
        so_far = layer.cost[node] + _wait(near, count, layer, node, 0)
        if twin == node:
            _outlooks(near, count, slot, so_far, children, first, first + num_actions)
        else:
            other_so_far = layer.cost[twin] + _wait(near, count, layer, twin, 1)
            beginnings = first, twin * num_actions
            _twin_outlooks(near, count, slot, (so_far, other_so_far), children, beginnings, num_actions)
        if node == 0:
            _outlooks(near, count, slot, so_far, children, last, last + 1)


@compiled
def _take_near(
    crowd: Float32Array, near: Near, layer: Layer, slot: Slot, reach_m: float, present: int
) -> tuple[float, int]:
    """Who is near, in whole vectors, and what the others cost without their ages."""
    west, south = np.float32(np.inf), np.float32(np.inf)
    east, north = -west, -south
    for node in range(layer.size):
        at_e, at_n = np.float32(layer.pos_m[node, 0]), np.float32(layer.pos_m[node, 1])
        west, east, south, north = min(west, at_e), max(east, at_e), min(south, at_n), max(north, at_n)
    reach, count, total = np.float32(reach_m) + SLACK_M, 0, 0.0
    for user in range(crowd.shape[1]):
        d_east = max(west - crowd[EAST, user], crowd[EAST, user] - east, ZERO)
        d_north = max(south - crowd[NORTH, user], crowd[NORTH, user] - north, ZERO)
        least = np.sqrt(d_east * d_east + d_north * d_north) - crowd[INNER, user] - reach
        near.apart[user] = ZERO
        if user < present and max(least, ZERO) < crowd[OTHERS, user]:
            near.who[count] = user
            count += 1
        elif user < present:
            gap = crowd[OTHERS, user]
            miss = min(gap * crowd[FADE, user], ONE)
            price = crowd[WEIGHT, user] * (slot.age_price + slot.leaf_price * gap)
            near.apart[user] = miss * price
            total += price + slot.cover_price * miss
    whole = -(-count // VECTOR) * VECTOR
    for row in range(crowd.shape[0]):
        for index in range(count):
            near.crowd[row, index] = crowd[row, near.who[index]]
        near.crowd[row, count:whole] = ZERO
    near.who[count:whole] = 0  # of no weight
    return float(total - slot.cover_price * present), whole


@compiled
def _wait(near: Near, count: int, layer: Layer, node: int, row: int) -> float:
    """What the ages of those who are not near cost; those of the near go into a row of ``near.waiting``."""
    aoi = layer.aoi_slots
    for index in range(count):
        near.waiting[row, index] = near.crowd[WEIGHT, index] * aoi[node, near.who[index]]
    aged = ZERO
    for user in range(aoi.shape[1]):
        aged += near.apart[user] * aoi[node, user]
    return float(aged)


@compiled
def _pair_up(layer: Layer, twin: IntArray, by_velocity: bool) -> None:
    """Nodes at one place, two by two; with inertia what a move does depends on the velocity too, so there are none."""
    for node in range(layer.size):
        twin[node] = node
    for node in range(0 if by_velocity else layer.size):
        for other in range(node + 1, layer.size):
            if (
                twin[node] == node
                and twin[other] == other
                and abs(layer.pos_m[node, 0] - layer.pos_m[other, 0]) < SAME_M
                and abs(layer.pos_m[node, 1] - layer.pos_m[other, 1]) < SAME_M
            ):
                twin[node], twin[other] = other, node


@compiled
def _spread_beside(table: MoveTable, vel_mps: FloatArray, layer: Layer, children: Children) -> float:
    """``_spread`` of the first node from a velocity that is none of the table's (policy.world.motion.slot_motion);
    strikes the moves that cannot be reached in a slot. Returns the longest way, squared.
    """
    most_2, slot_s, accel = 0.0, table.slot_s, table.max_accel_mps2
    start = vel_mps[0], vel_mps[1]
    for action in range(table.vel_mps.shape[0]):
        flown = table.vel_mps[action, 0], table.vel_mps[action, 1]
        end = table.end_mps[action, 0], table.end_mps[action, 1]
        straight_s = _apart(flown, end) / accel
        first_e, first_n, first_s = _turn(start, flown, accel, slot_s - straight_s)
        last_e, last_n, last_s = _turn(flown, end, accel, slot_s - first_s)
        step_e = first_e + flown[0] * (slot_s - first_s - last_s) + last_e
        step_n = first_n + flown[1] * (slot_s - first_s - last_s) + last_n
        children.pos_m[action, 0], children.pos_m[action, 1] = layer.pos_m[0, 0] + step_e, layer.pos_m[0, 1] + step_n
        most_2 = max(most_2, step_e * step_e + step_n * step_n)
        if action > 0 and _apart(start, flown) / accel + straight_s > slot_s:
            children.rank[action] = np.inf
    return most_2


@compiled
def _turn(
    from_mps: tuple[float, float], to_mps: tuple[float, float], accel_mps2: float, most_s: float
) -> tuple[float, float, float]:
    """Way, east and north, and time of a change of velocity (policy.world.motion.make_turn)."""
    straight_s = _apart(from_mps, to_mps) / accel_mps2
    cross = from_mps[0] * to_mps[1] - from_mps[1] * to_mps[0]
    angle_rad = np.arctan2(cross, from_mps[0] * to_mps[0] + from_mps[1] * to_mps[1])
    one, other = _apart(from_mps, (0.0, 0.0)), _apart(to_mps, (0.0, 0.0))
    bend = min(max((np.pi - abs(angle_rad)) / REVERSAL_RAD, 0.0), 1.0)
    bend *= min(min(one, other) / (SLOW_SHARE * max(one, other) + TINY), 1.0)
    half_rad = max(0.5 * abs(angle_rad) * bend, STRAIGHT_RAD)
    longer_s = straight_s * (half_rad / np.sin(half_rad)) - straight_s
    half_rad = max(half_rad * min(max((most_s - straight_s) / (longer_s + TINY), 0.0), 1.0), STRAIGHT_RAD)
    time_s = straight_s * (half_rad / np.sin(half_rad))
    across = np.copysign(0.5 * (np.cos(half_rad) / np.sin(half_rad) - 1.0 / half_rad), -cross)
    d_e, d_n = to_mps[0] - from_mps[0], to_mps[1] - from_mps[1]
    return (
        time_s * (from_mps[0] + 0.5 * d_e - across * d_n),
        time_s * (from_mps[1] + 0.5 * d_n + across * d_e),
        time_s,
    )


@compiled
def _apart(one: tuple[float, float], other: tuple[float, float]) -> float:
    east, north = other[0] - one[0], other[1] - one[1]
    return float(np.sqrt(east * east + north * north))


@compiled
def _cruise_j(table: MoveTable, way_m: float) -> float:
    """Energy of a slot at the steady speed that covers ``way_m``."""
    at = min(way_m / table.cruise_step_m, table.cruise_j.size - 1.0)
    low = min(int(at), table.cruise_j.size - 2)
    return float(table.cruise_j[low] + (at - low) * (table.cruise_j[low + 1] - table.cruise_j[low]))


@compiled
def _outlooks(near: Near, count: int, slot: Slot, so_far: float, children: Children, first: int, end: int) -> None:
    """Add to the ranks of a node's children, the legal of ``first`` to ``end``, what users' ages after the slot (Eq. 4)
    cost, in it and in the leaf, and those missed. All moves of a node in one call: each call has its price.
    """
    crowd, waiting = near.crowd, near.waiting
    age_price, leaf_price, cover_price = slot.age_price, slot.leaf_price, slot.cover_price
    for child in range(first, end):
        if children.rank[child] == np.inf:
            continue
        east_m, north_m = np.float32(children.pos_m[child, 0]), np.float32(children.pos_m[child, 1])
        total = ZERO
        for user in range(count):
            d_east, d_north = crowd[EAST, user] - east_m, crowd[NORTH, user] - north_m
            gap = max(np.sqrt(d_east * d_east + d_north * d_north) - crowd[INNER, user], ZERO)
            gap = min(gap, crowd[OTHERS, user])
            miss = min(gap * crowd[FADE, user], ONE)
            aged = crowd[WEIGHT, user] + miss * waiting[0, user]
            total += aged * (age_price + leaf_price * gap) + cover_price * miss
        children.rank[child] += so_far + total


@compiled
def _twin_outlooks(
    near: Near,
    count: int,
    slot: Slot,
    so_far: tuple[float, float],
    children: Children,
    first: tuple[int, int],
    num_actions: int,
) -> None:
    """``_outlooks`` of two nodes at one place, whose moves lead to the same places."""
    crowd, waiting, rank = near.crowd, near.waiting, children.rank
    age_price, leaf_price, cover_price = slot.age_price, slot.leaf_price, slot.cover_price
    for action in range(num_actions):
        child, other = first[0] + action, first[1] + action
        if rank[child] == np.inf and rank[other] == np.inf:
            continue
        east_m, north_m = np.float32(children.pos_m[child, 0]), np.float32(children.pos_m[child, 1])
        total, other_total = ZERO, ZERO
        for user in range(count):
            d_east, d_north = crowd[EAST, user] - east_m, crowd[NORTH, user] - north_m
            gap = max(np.sqrt(d_east * d_east + d_north * d_north) - crowd[INNER, user], ZERO)
            gap = min(gap, crowd[OTHERS, user])
            miss = min(gap * crowd[FADE, user], ONE)
            price = age_price + leaf_price * gap
            total += (crowd[WEIGHT, user] + miss * waiting[0, user]) * price + cover_price * miss
            other_total += (crowd[WEIGHT, user] + miss * waiting[1, user]) * price + cover_price * miss
        rank[child] += so_far[0] + total
        rank[other] += so_far[1] + other_total


@compiled
def _best_child(rank: FloatArray, num_actions: int) -> int:
    """How the trail goes on where it is open: the best child of node 0."""
    child = np.argmin(rank[:num_actions])
    return int(child) if np.isfinite(rank[child]) else NO_MOVE


@compiled
def _chosen(
    scene: Scene,
    children: Children,
    layer: Layer,
    crowd: Float32Array,
    slot: Slot,
    kept: tuple[int, int],
    below: Layer,
) -> Layer:
    """The best children without duplicates in order of rank, written into ``below``; the trail's, ``kept`` with its
    command, before all.
    """
    effort, beam, count = scene.effort, scene.effort.beam, max(scene.users.present, 1)
    order = _best(children.rank, beam + SPARE)
    last = children.rank.size - 1
    num_actions = last // layer.size
    keys, size = np.empty(beam, np.int64), 0
    for index in range(-1, SHORTLIST * beam):
        if index == beam + SPARE:
            order = _best(children.rank, SHORTLIST * beam)
        if size == beam or index >= order.size:
            break
        child = kept[0] if index < 0 else order[index]
        if child == NO_MOVE or (index >= 0 and child == kept[0]):
            continue
        east, north = children.pos_m[child, 0], children.pos_m[child, 1]
        parent, action = (0, kept[1]) if child == last else (child // num_actions, child % num_actions)
        keys[size] = (int(np.floor(east / effort.cell_m)) * CELLS + int(np.floor(north / effort.cell_m))) * CELLS
        if effort.by_velocity:
            keys[size] += scene.table.end_index[child % num_actions]  # the trail's, none of the table's: as at rest
        age, wait, missed = _renew(crowd, layer, parent, np.float32(east), np.float32(north), below, size)
        if _known(keys, below.aoi_slots, size):
            continue
        paid = scene.prices.energy * children.spent_j[child] - scene.prices.cover * (1.0 - missed / count)
        below.cost[size] = layer.cost[parent] + slot.age_price * age + slot.discount * paid
        below.leaf[size] = slot.leaf_price * wait
        below.parent[size], below.last[size] = parent, action
        below.pos_m[size, 0], below.pos_m[size, 1] = east, north
        size += 1
    return Layer(size, below.parent, below.last, below.pos_m, below.cost, below.leaf, below.aoi_slots)


@compiled
def _known(keys: IntArray, aoi: Float32Array, new: int) -> bool:
    """One of those before is in the same cell, by the same velocity and with the same AoI of every user."""
    for old in range(new):
        if keys[old] == keys[new]:
            differ = np.int32(0)
            for user in range(aoi.shape[1]):
                differ |= np.int32(aoi[old, user] + HALF) ^ np.int32(aoi[new, user] + HALF)
            if differ == 0:
                return True
    return False


@compiled
def _best(rank: FloatArray, count: int) -> IntArray:
    """Indices of the ``count`` least finite ranks, in order; equal ones by index.

    Ranks go into bins of equal width, and only the first bins are sorted: most children are never compared.
    """
    least, most = np.inf, -np.inf
    for child in range(rank.size):
        if np.isfinite(rank[child]):
            least, most = min(least, rank[child]), max(most, rank[child])
    scale = (BINS - 1) / (most - least) if most - least > LEAST_RANGE else 0.0
    bins, first = np.full(rank.size, BINS, np.int64), np.zeros(BINS + 1, np.int64)
    for child in range(rank.size):
        if np.isfinite(rank[child]):
            bins[child] = max(0, min(int((rank[child] - least) * scale), BINS - 1))
            first[bins[child] + 1] += 1
    used = 0
    while used < BINS and first[used] < count:
        used += 1
        first[used] += first[used - 1]
    order, free = np.empty(first[used], np.int64), first.copy()
    for child in range(rank.size):
        if bins[child] < used:
            at = free[bins[child]]
            free[bins[child]] += 1
            while at > first[bins[child]] and rank[order[at - 1]] > rank[child]:
                order[at] = order[at - 1]
                at -= 1
            order[at] = child
    return order[:count]


@compiled
def _renew(
    crowd: Float32Array, layer: Layer, parent: int, east_m: np.float32, north_m: np.float32, below: Layer, new: int
) -> tuple[float, float, float]:
    """Write the AoI after the slot (Eq. 4, expected) into the layer ``below``. Weighted sums over users: of it, of it x
    metres to reach; number missed.
    """
    aoi, new_aoi = layer.aoi_slots, below.aoi_slots
    age, wait, missed = ZERO, ZERO, ZERO
    for user in range(aoi.shape[1]):
        d_east, d_north = crowd[EAST, user] - east_m, crowd[NORTH, user] - north_m
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - crowd[INNER, user], ZERO)
        gap = min(gap, crowd[OTHERS, user])
        miss = min(gap * crowd[FADE, user], ONE)
        aged = ONE + miss * aoi[parent, user]
        new_aoi[new, user] = aged
        age += crowd[WEIGHT, user] * aged
        wait += crowd[WEIGHT, user] * aged * gap
        missed += miss
    return float(age), float(wait), float(missed)


@compiled
def _trace(parents: IntArray, moves: IntArray, places: FloatArray, kept: int) -> tuple[IntArray, FloatArray]:
    """Commands [K', H] and places [K', H, 2] that lead to each node of the last layer."""
    horizon = parents.shape[0]
    actions, path_m = np.zeros((kept, horizon), np.int64), np.zeros((kept, horizon, 2))
    for end in range(kept):
        node = end
        for depth in range(horizon - 1, -1, -1):
            actions[end, depth] = moves[depth, node]
            path_m[end, depth, 0], path_m[end, depth, 1] = places[depth, node, 0], places[depth, node, 1]
            node = parents[depth, node]
    return actions, path_m


@compiled
def _legal(scene: Scene, start: Start, pos_m: tuple[float, float], last: int) -> BoolArray:
    """Moves [A]: the first by the world's own judgement, later ones as policy.world.airspace.legal_moves does.

    Where there is none it brakes: only a UAV that began outside the rules can come to this.
    """
    legal: BoolArray = start.allowed[last].copy()
    if last == scene.table.box_m.shape[0]:
        return legal
    _keep_inside(scene, start, pos_m, last, legal)
    walls = scene.walls
    if walls.box_m.shape[0] == 0:
        return legal
    for action in range(legal.size):
        for obstacle in range(walls.box_m.shape[0]):
            legal[action] = legal[action] and not _hits(scene, pos_m, last, action, obstacle)
    legal[0] = legal[0] or not np.any(legal)
    return legal


@compiled
def _keep_inside(scene: Scene, start: Start, pos_m: tuple[float, float], last: int, legal: BoolArray) -> None:
    """Which of the allowed moves [A] stay within the area on all of their way, into ``legal``; braking if none does."""
    low_m, high_m, box_m = scene.walls.low_m, scene.walls.high_m, scene.table.box_m
    west, south, east, north = low_m[0] - pos_m[0], low_m[1] - pos_m[1], high_m[0] - pos_m[0], high_m[1] - pos_m[1]
    is_any = False
    for action in range(legal.size):
        in_east = (box_m[last, action, 0] >= west) & (box_m[last, action, 2] <= east)
        in_north = (box_m[last, action, 1] >= south) & (box_m[last, action, 3] <= north)
        legal[action] = start.allowed[last, action] & in_east & in_north
        is_any |= legal[action]
    legal[0] |= not is_any


@compiled
def _hits(scene: Scene, pos_m: tuple[float, float], last: int, action: int, obstacle: int) -> bool:
    """A point of the way lies within the margin of an obstacle."""
    table, walls = scene.table, scene.walls
    for axis in range(2):
        at_m = pos_m[axis]
        if at_m + table.box_m[last, action, 2 + axis] < walls.box_m[obstacle, axis]:
            return False
        if at_m + table.box_m[last, action, axis] > walls.box_m[obstacle, 2 + axis]:
            return False
    corners = walls.corner_m[walls.first[obstacle] : walls.first[obstacle + 1]]
    for point in range(table.points_m.shape[2]):
        east = pos_m[0] + table.points_m[last, action, point, 0]
        north = pos_m[1] + table.points_m[last, action, point, 1]
        if _near(east, north, corners, walls.margin_m):
            return True
    return False


@compiled
def _near(east: float, north: float, corners_m: FloatArray, margin_m: float) -> bool:
    """Inside a polygon [C, 2] or within the margin of an edge: policy.world.geometry.distance_to_polygon_m."""
    inside = False
    for index in range(corners_m.shape[0]):
        e0, n0 = corners_m[index]
        e1, n1 = corners_m[(index + 1) % corners_m.shape[0]]
        if (n0 > north) != (n1 > north) and east < e0 + (north - n0) * (e1 - e0) / (n1 - n0):
            inside = not inside
        along_e, along_n = e1 - e0, n1 - n0
        length_2 = along_e * along_e + along_n * along_n
        share = ((east - e0) * along_e + (north - n0) * along_n) / (length_2 if length_2 > 0.0 else 1.0)
        share = min(max(share, 0.0), 1.0)
        d_e, d_n = east - e0 - share * along_e, north - n0 - share * along_n
        if d_e * d_e + d_n * d_n <= margin_m * margin_m:
            return True
    return inside
