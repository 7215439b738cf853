"""The compiled beam search of one UAV over H slots, the other UAVs' paths held fixed.

A node is a place, the index of the last command (A: the present velocity) and the AoI of all users. Nodes are
ranked by the cost so far and the leaf term. Paths that have come to one cell with one AoI of every user are one
path: the better one stays. The kept path ("trail") always survives, so the search never ends worse than it.
"""

from typing import NamedTuple

import numpy as np

from policy.search.compiled import compiled
from policy.search.moves import MoveTable, Walls
from policy.search.problem import Effort, Float32Array, Prices, Start, Users
from policy.world.arrays import BoolArray, FloatArray, IntArray

NO_MOVE = -1
ONE = np.float32(1.0)
ZERO = np.float32(0.0)
SHORTLIST = 3  # candidates looked at for each one kept; the rest are duplicates
HASH_STEP = np.int64(6364136223846793005)  # Knuth's multiplier (MMIX)
HASH_SPREAD = np.int64(1442695040888963407)


class Scene(NamedTuple):
    """What all UAVs' searches of one slot share."""

    users: Users
    prices: Prices
    table: MoveTable
    walls: Walls
    effort: Effort


class Beam(NamedTuple):
    """The K' <= K paths left at the horizon's end; the trail's, where there is one, is the first."""

    actions: IntArray  # [K', H]
    cost: FloatArray  # [K'] discounted, without what comes after the horizon
    leaf: FloatArray  # [K'] the closed-form cost of what comes after
    pos_m: FloatArray  # [K', 2]
    aoi_slots: Float32Array  # [K', N]


class Layer(NamedTuple):
    """K nodes of one depth."""

    pos_m: FloatArray  # [K, 2]
    last: IntArray  # [K]
    cost: FloatArray  # [K]
    aoi_slots: Float32Array  # [K, N]


class Children(NamedTuple):
    """K A children in order of node and action; infinite cost and rank: not legal."""

    cost: FloatArray  # [K A]
    leaf: FloatArray  # [K A]
    rank: FloatArray  # [K A] cost and leaf
    pos_m: FloatArray  # [K A, 2]


class Crowd(NamedTuple):
    """The users at the end of one slot."""

    east_m: Float32Array  # [N]
    north_m: Float32Array  # [N]
    weight: Float32Array  # [N]
    others_gap_m: Float32Array  # [N] from the nearest other UAV's serving radius, 0 within it
    radius_m: np.float32
    salt: IntArray  # [N] for hashing


@compiled
def search(scene: Scene, start: Start, trail: IntArray, others_gap_m: Float32Array) -> Beam:
    """``trail`` [H] actions to keep (NO_MOVE: any, from there on), ``others_gap_m`` [H, N]."""
    users, prices, beam = scene.users, scene.prices, scene.effort.beam
    horizon, num_actions = users.east_m.shape[0], start.allowed.shape[1]
    parents, moves = np.zeros((horizon, beam), np.int64), np.zeros((horizon, beam), np.int64)
    layer = _root(start, users)
    leaf, discount, on_trail = np.zeros(1), 1.0, trail[0] != NO_MOVE
    for depth in range(horizon):
        crowd = _crowd(users, depth, others_gap_m)
        leaf_price = discount * prices.discount * (prices.end if depth + 1 == horizon else prices.leaf)
        children = _expand(scene, start, layer, crowd, (discount, leaf_price))
        discount *= prices.discount
        kept_first = _trail_child(children.rank, trail[depth], num_actions) if on_trail else NO_MOVE
        on_trail = kept_first != NO_MOVE
        chosen, aoi = _choose(children, layer, crowd, kept_first, scene.effort)
        parents[depth, : chosen.size], moves[depth, : chosen.size] = chosen // num_actions, chosen % num_actions
        layer = Layer(children.pos_m[chosen], chosen % num_actions, children.cost[chosen], aoi)
        leaf = children.leaf[chosen]
    return Beam(_trace(parents, moves, layer.cost.size), layer.cost, leaf, layer.pos_m, layer.aoi_slots)


@compiled
def follow(scene: Scene, start: Start, actions: IntArray) -> tuple[IntArray, FloatArray]:
    """A kept plan [H] from where the UAV really is: (actions [H], places [H, 2]); from the first move that is no
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
def _root(start: Start, users: Users) -> Layer:
    aoi = users.aoi_slots.copy().reshape(1, users.aoi_slots.size)
    return Layer(start.pos_m.copy().reshape(1, 2), np.full(1, start.allowed.shape[1]), np.zeros(1), aoi)


@compiled
def _crowd(users: Users, depth: int, others_gap_m: Float32Array) -> Crowd:
    east_m, north_m = users.east_m[depth], users.north_m[depth]
    return Crowd(east_m, north_m, users.weight, others_gap_m[depth], np.float32(users.radius_m), users.salt)


@compiled
def _expand(
    scene: Scene, start: Start, layer: Layer, crowd: Crowd, discount_and_leaf_price: tuple[float, float]
) -> Children:
    """All moves of all nodes."""
    discount, leaf_price = discount_and_leaf_price
    nodes, num_actions = layer.last.size, start.allowed.shape[1]
    cost, leaf = np.full(nodes * num_actions, np.inf), np.zeros(nodes * num_actions)
    pos_m, prices = np.zeros((nodes * num_actions, 2)), scene.prices
    for node in range(nodes):
        place, last, aoi = (layer.pos_m[node, 0], layer.pos_m[node, 1]), layer.last[node], layer.aoi_slots[node]
        legal = _legal(scene, start, place, last)
        for action in range(num_actions):
            if not legal[action]:
                continue
            child = node * num_actions + action
            pos_m[child, 0] = place[0] + start.step_m[last, action, 0]
            pos_m[child, 1] = place[1] + start.step_m[last, action, 1]
            age, wait, covered = _outlook(crowd, aoi, pos_m[child, 0], pos_m[child, 1])
            slot_cost = age - prices.cover * covered + prices.energy * start.energy_j[last, action]
            cost[child], leaf[child] = layer.cost[node] + discount * slot_cost, leaf_price * wait
    return Children(cost, leaf, cost + leaf, pos_m)


@compiled
def _outlook(crowd: Crowd, aoi: Float32Array, east_m: float, north_m: float) -> tuple[float, float, float]:
    """Weighted sums over users after a slot that ends here: AoI (Eq. 4), AoI x metres to reach; share served."""
    age, wait, covered = ZERO, ZERO, ZERO
    east, north = np.float32(east_m), np.float32(north_m)
    for user in range(aoi.size):
        gap = _gap_m(crowd, user, east, north)
        aged = crowd.weight[user] * (aoi[user] + ONE if gap > ZERO else ONE)
        age += aged
        wait += aged * gap
        covered += ZERO if gap > ZERO else ONE
    return float(age), float(wait), float(covered) / max(aoi.size, 1)


@compiled
def _gap_m(crowd: Crowd, user: int, east: np.float32, north: np.float32) -> np.float32:
    """Metres from the nearest UAV's serving radius; 0: served (Def. 1, as loss grows with distance)."""
    d_east, d_north = crowd.east_m[user] - east, crowd.north_m[user] - north
    gap = max(np.sqrt(d_east * d_east + d_north * d_north) - crowd.radius_m, ZERO)
    return min(gap, crowd.others_gap_m[user])


@compiled
def _trail_child(rank: FloatArray, action: int, num_actions: int) -> int:
    """The trail's next node among the children of node 0, or NO_MOVE where it is no longer legal."""
    child = np.argmin(rank[:num_actions]) if action == NO_MOVE else action
    return int(child) if np.isfinite(rank[child]) else NO_MOVE


@compiled
def _choose(
    children: Children, layer: Layer, crowd: Crowd, kept_first: int, effort: Effort
) -> tuple[IntArray, Float32Array]:
    """The best children without duplicates in order of rank, the trail's before all, and their AoI."""
    order = _best(children.rank, SHORTLIST * effort.beam)
    num_actions = children.rank.size // layer.last.size
    chosen, codes = np.zeros(effort.beam, np.int64), np.zeros(effort.beam, np.int64)
    aoi = np.zeros((effort.beam, layer.aoi_slots.shape[1]), np.float32)
    kept = 0
    for place in range(-1, order.size):
        child = kept_first if place < 0 else order[place]
        if child == NO_MOVE or (place >= 0 and child == kept_first):
            continue
        if kept == effort.beam:
            break
        east, north = children.pos_m[child]
        code = _renew(crowd, layer.aoi_slots[child // num_actions], east, north, aoi[kept])
        code = _mix(_mix(code, np.floor(east / effort.cell_m)), np.floor(north / effort.cell_m))
        code = _mix(code, child % num_actions) if effort.by_velocity else code
        if not _known(codes, kept, code):
            chosen[kept], codes[kept] = child, code
            kept += 1
    return chosen[:kept], aoi[:kept]


@compiled
def _known(codes: IntArray, count: int, code: np.int64) -> bool:
    found = False
    for index in range(count):
        found |= codes[index] == code
    return found


@compiled
def _best(rank: FloatArray, count: int) -> IntArray:
    """Indices of the ``count`` least finite ranks, in order; equal ones by index."""
    limit = np.partition(rank, count)[count] if rank.size > count else np.inf
    candidates = np.flatnonzero((rank <= limit) & np.isfinite(rank))
    return candidates[np.argsort(rank[candidates], kind="mergesort")]


@compiled
def _renew(crowd: Crowd, aoi: Float32Array, east_m: float, north_m: float, new_aoi: Float32Array) -> np.int64:
    """Write the AoI after the slot (Eq. 4) into ``new_aoi`` [N] and return a hash of it."""
    east, north = np.float32(east_m), np.float32(north_m)
    for user in range(aoi.size):
        new_aoi[user] = aoi[user] + ONE if _gap_m(crowd, user, east, north) > ZERO else ONE
    code = np.int64(0)
    for user in range(aoi.size):
        code += np.int64(np.int32(new_aoi[user])) * crowd.salt[user]
    return code


@compiled
def _mix(code: np.int64, value: float) -> np.int64:
    """Fold one more number into a hash."""
    code = (code ^ (code >> np.int64(29))) * HASH_STEP
    return code + np.int64(value) * HASH_SPREAD


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
def _legal(scene: Scene, start: Start, pos_m: tuple[float, float], last: int) -> BoolArray:
    """Moves [A]: the first by the world's own judgement, later ones as policy.world.airspace.legal_moves does.

    Where there is none it brakes: only a UAV that began outside the rules can come to this.
    """
    legal: BoolArray = start.allowed[last].copy()
    if last == scene.table.box_m.shape[0]:
        return legal
    box_m, low_m, high_m = scene.table.box_m[last], scene.walls.low_m, scene.walls.high_m
    obstacles = scene.walls.box_m.shape[0]
    for action in range(legal.size):
        inside = pos_m[0] + box_m[action, 0] >= low_m[0] and pos_m[0] + box_m[action, 2] <= high_m[0]
        inside = inside and pos_m[1] + box_m[action, 1] >= low_m[1] and pos_m[1] + box_m[action, 3] <= high_m[1]
        legal[action] = legal[action] and inside
        for obstacle in range(obstacles):
            legal[action] = legal[action] and not _hits(scene, pos_m, last, action, obstacle)
    legal[0] = legal[0] or not np.any(legal)
    return legal


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
