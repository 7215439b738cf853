"""The compiled beam search of one UAV over H slots, the other UAVs' paths held fixed.

A node is a place, the index of the last command (A: the present velocity) and the AoI of all users. Nodes are
ranked by the cost so far and the leaf term. Paths that have come to one cell with one AoI of every user are one
path: the better one stays. The kept path ("trail") always survives, so the search never ends worse than it.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from policy.search.compiled import compiled
from policy.search.moves import MoveTable, Walls
from policy.search.problem import Float32Array, Prices, Users
from policy.world.arrays import BoolArray, FloatArray, IntArray

NO_MOVE = -1
ONE = np.float32(1.0)
ZERO = np.float32(0.0)
SHORTLIST = 3  # candidates looked at for each one kept; the rest are duplicates
Hashes = npt.NDArray[np.uint64]


class Start(NamedTuple):
    """One UAV now."""

    pos_m: FloatArray  # [2]
    step_m: FloatArray  # [A, 2] of the first slot
    energy_j: FloatArray  # [A]
    allowed: BoolArray  # [A]


class Beam(NamedTuple):
    """The K' <= K paths left at the horizon's end; the trail's, where there is one, is the first."""

    actions: IntArray  # [K', H]
    cost: FloatArray  # [K'] discounted, without what comes after the horizon
    leaf: FloatArray  # [K'] the closed-form cost of what comes after
    pos_m: FloatArray  # [K', 2]
    aoi_slots: Float32Array  # [K', N]


@compiled
def search(
    start: Start,
    trail: IntArray,
    others_gap_m: Float32Array,
    users: Users,
    prices: Prices,
    table: MoveTable,
    walls: Walls,
    beam: int,
    cell_m: float,
) -> Beam:
    """``trail`` [H] actions to keep (NO_MOVE: any, at its end), ``others_gap_m`` [H, N] from the nearest other UAV's
    serving radius to each user, 0 within it.
    """
    horizon, num_users = users.east_m.shape
    num_actions = start.allowed.shape[0]
    parents = np.zeros((horizon, beam), np.int64)
    moves = np.zeros((horizon, beam), np.int64)
    pos_m, cost, last = start.pos_m.copy().reshape(1, 2), np.zeros(1), np.full(1, num_actions)
    aoi = users.aoi_slots.copy().reshape(1, num_users)
    leaf = np.zeros(1)
    on_trail = trail[0] != NO_MOVE
    discount = 1.0
    for depth in range(horizon):
        new_cost, new_leaf, new_pos_m = _expand(
            depth, start, pos_m, last, cost, aoi, others_gap_m[depth], users, prices, table, walls, discount
        )
        discount *= prices.discount
        leaf_price = discount * (prices.end if depth + 1 == horizon else prices.leaf)
        rank = new_cost + leaf_price * new_leaf
        kept_first = _trail_child(rank, trail[depth], num_actions) if on_trail else NO_MOVE
        on_trail = kept_first != NO_MOVE
        chosen, aoi = _choose(
            rank, new_pos_m, aoi, kept_first, others_gap_m[depth], users, depth, beam, cell_m, num_actions, table
        )
        kept = chosen.shape[0]
        parents[depth, :kept], moves[depth, :kept] = chosen // num_actions, chosen % num_actions
        last = chosen % num_actions
        pos_m, cost, leaf = new_pos_m[chosen], new_cost[chosen], leaf_price * new_leaf[chosen]
    return Beam(_trace(parents, moves, cost.shape[0]), cost, leaf, pos_m, aoi)


@compiled
def follow(start: Start, actions: IntArray, table: MoveTable, walls: Walls) -> tuple[IntArray, FloatArray]:
    """A kept plan [H] from where the UAV really is: (actions [H], places [H, 2]); from the first move that is no
    longer possible on it brakes and hovers.
    """
    horizon, num_actions = actions.shape[0], start.allowed.shape[0]
    flown, path_m = np.zeros(horizon, np.int64), np.zeros((horizon, 2))
    pos_m, last, broken = start.pos_m.copy(), num_actions, False
    for depth in range(horizon):
        action = actions[depth]
        broken = broken or action == NO_MOVE or not _legal(depth, start, pos_m, last, action, table, walls)
        if broken:
            action = 0
        pos_m = pos_m + (start.step_m[action] if depth == 0 else table.step_m[last, action])
        flown[depth], path_m[depth], last = action, pos_m, action
    return flown, path_m


@compiled
def _expand(
    depth: int,
    start: Start,
    pos_m: FloatArray,
    last: IntArray,
    cost: FloatArray,
    aoi: Float32Array,
    others_gap_m: Float32Array,
    users: Users,
    prices: Prices,
    table: MoveTable,
    walls: Walls,
    discount: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cost [K A] (infinite: not legal), leaf term [K A] and place [K A, 2] of every child."""
    nodes, num_actions = pos_m.shape[0], start.allowed.shape[0]
    new_cost, new_leaf = np.full(nodes * num_actions, np.inf), np.zeros(nodes * num_actions)
    new_pos_m = np.zeros((nodes * num_actions, 2))
    for node in range(nodes):
        stuck = True  # then it brakes: only a UAV that began outside the rules can come to this
        for action in range(num_actions - 1, -1, -1):
            if not _legal(depth, start, pos_m[node], last[node], action, table, walls) and not (stuck and action == 0):
                continue
            stuck = False
            child = node * num_actions + action
            step_m = start.step_m[action] if depth == 0 else table.step_m[last[node], action]
            energy_j = start.energy_j[action] if depth == 0 else table.energy_j[last[node], action]
            east, north = pos_m[node, 0] + step_m[0], pos_m[node, 1] + step_m[1]
            age, wait, covered = _outlook(aoi[node], others_gap_m, users, depth, np.float32(east), np.float32(north))
            new_cost[child] = cost[node] + discount * (age - prices.cover * covered + prices.energy * energy_j)
            new_leaf[child] = wait
            new_pos_m[child, 0], new_pos_m[child, 1] = east, north
    return new_cost, new_leaf, new_pos_m


@compiled
def _outlook(
    aoi: Float32Array, others_gap_m: Float32Array, users: Users, depth: int, east: np.float32, north: np.float32
) -> tuple[float, float, float]:
    """Weighted sums over users after a slot that ends here: AoI (Eq. 4), AoI x metres to reach, share served."""
    age, wait, covered = ZERO, ZERO, ZERO
    east_m, north_m, weight = users.east_m[depth], users.north_m[depth], users.weight
    radius = np.float32(users.radius_m)
    for user in range(aoi.shape[0]):
        d_east, d_north = east_m[user] - east, north_m[user] - north
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - radius, ZERO)
        gap = min(gap, others_gap_m[user])
        served = gap <= ZERO
        aged = weight[user] * (ONE if served else aoi[user] + ONE)
        age += aged
        wait += aged * gap
        covered += ONE if served else ZERO
    return float(age), float(wait), float(covered) / max(aoi.shape[0], 1)


@compiled
def _trail_child(rank: FloatArray, action: int, num_actions: int) -> int:
    """The trail's next node among the children of node 0, or NO_MOVE where it ends or is no longer legal."""
    child = np.argmin(rank[:num_actions]) if action == NO_MOVE else action
    return int(child) if np.isfinite(rank[child]) else NO_MOVE


@compiled
def _choose(
    rank: FloatArray,
    pos_m: FloatArray,
    aoi: Float32Array,
    kept_first: int,
    others_gap_m: Float32Array,
    users: Users,
    depth: int,
    beam: int,
    cell_m: float,
    num_actions: int,
    table: MoveTable,
) -> tuple[IntArray, Float32Array]:
    """The best children without duplicates, in order of rank (the trail's before all), and their AoI."""
    order = _best(rank, SHORTLIST * beam)
    chosen, hashes = np.zeros(beam, np.int64), np.zeros(beam, np.uint64)
    new_aoi = np.zeros((beam, aoi.shape[1]), np.float32)
    kept = 0
    for place in range(-1, order.shape[0]):
        child = kept_first if place < 0 else order[place]
        if kept == beam or child == NO_MOVE or (place >= 0 and child == kept_first):
            continue
        node = child // num_actions
        code = _renew(aoi[node], others_gap_m, users, depth, pos_m[child], new_aoi[kept])
        code = _mix(code + np.uint64(_cell(pos_m[child], cell_m)))
        if table.remembers:
            code = _mix(code + np.uint64(child % num_actions))
        if not _known(hashes, kept, code):
            chosen[kept], hashes[kept] = child, code
            kept += 1
    return chosen[:kept], new_aoi[:kept]


@compiled
def _best(rank: FloatArray, count: int) -> IntArray:
    """Indices of the ``count`` least finite ranks, in order; equal ones by index."""
    if rank.shape[0] > count:
        limit = np.partition(rank, count)[count]
        candidates = np.flatnonzero((rank <= limit) & np.isfinite(rank))
    else:
        candidates = np.flatnonzero(np.isfinite(rank))
    return candidates[np.argsort(rank[candidates], kind="mergesort")]


@compiled
def _renew(
    aoi: Float32Array,
    others_gap_m: Float32Array,
    users: Users,
    depth: int,
    pos_m: FloatArray,
    new_aoi: Float32Array,
) -> np.uint64:
    """Write the AoI after the slot (Eq. 4) into ``new_aoi`` [N] and return a hash of it."""
    code = np.uint64(0)
    east, north, radius = np.float32(pos_m[0]), np.float32(pos_m[1]), np.float32(users.radius_m)
    for user in range(aoi.shape[0]):
        d_east, d_north = users.east_m[depth, user] - east, users.north_m[depth, user] - north
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - radius, ZERO)
        new_aoi[user] = ONE if min(gap, others_gap_m[user]) <= ZERO else aoi[user] + ONE
        code = code * np.uint64(0x9E3779B97F4A7C15) + np.uint64(new_aoi[user])
    return code


@compiled
def _mix(code: np.uint64) -> np.uint64:
    """Spread a number over 64 bits (the finaliser of splitmix64; Steele, Lea, Flood 2014)."""
    code = (code ^ (code >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    code = (code ^ (code >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return code ^ (code >> np.uint64(31))


@compiled
def _cell(pos_m: FloatArray, cell_m: float) -> int:
    return int(np.floor(pos_m[0] / cell_m)) * 1_000_003 + int(np.floor(pos_m[1] / cell_m))


@compiled
def _known(hashes: Hashes, count: int, code: np.uint64) -> bool:
    for index in range(count):
        if hashes[index] == code:
            return True
    return False


@compiled
def _trace(parents: IntArray, moves: IntArray, kept: int) -> IntArray:
    """The actions [K', H] that lead to each node of the last layer."""
    horizon = parents.shape[0]
    actions = np.zeros((kept, horizon), np.int64)
    for end in range(kept):
        node = end
        for depth in range(horizon - 1, -1, -1):
            actions[end, depth] = moves[depth, node]
            node = parents[depth, node]
    return actions


@compiled
def _legal(depth: int, start: Start, pos_m: FloatArray, last: int, action: int, table: MoveTable, walls: Walls) -> bool:
    """The first move by the world's own judgement, later ones by the table: as policy.world.airspace.legal_moves."""
    if depth == 0:
        return bool(start.allowed[action])
    if not table.reachable[last, action]:
        return False
    box_m = table.box_m[last, action]
    for axis in range(2):
        if pos_m[axis] + box_m[axis] < walls.low_m[axis] or pos_m[axis] + box_m[2 + axis] > walls.high_m[axis]:
            return False
    for obstacle in range(walls.box_m.shape[0]):
        if _hits(pos_m, box_m, table.points_m[last, action], obstacle, walls):
            return False
    return True


@compiled
def _hits(pos_m: FloatArray, box_m: FloatArray, points_m: FloatArray, obstacle: int, walls: Walls) -> bool:
    """A point of the way lies within the margin of an obstacle."""
    wall_m = walls.box_m[obstacle]
    for axis in range(2):
        if pos_m[axis] + box_m[2 + axis] < wall_m[axis] or pos_m[axis] + box_m[axis] > wall_m[2 + axis]:
            return False
    corners = walls.corner_m[walls.first[obstacle] : walls.first[obstacle + 1]]
    for point in range(points_m.shape[0]):
        if _near(pos_m[0] + points_m[point, 0], pos_m[1] + points_m[point, 1], corners, walls.margin_m):
            return True
    return False


@compiled
def _near(east: float, north: float, corners: FloatArray, margin_m: float) -> bool:
    """Inside a polygon [C, 2] or within the margin of an edge: policy.world.geometry.distance_to_polygon_m."""
    inside = False
    for index in range(corners.shape[0]):
        e0, n0 = corners[index]
        e1, n1 = corners[(index + 1) % corners.shape[0]]
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
