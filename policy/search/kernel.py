"""The compiled beam search of one UAV over H slots, the other UAVs' paths held fixed.

A node is a place, the index of the last command (A: the present velocity) and the AoI of all users. Nodes are
ranked by the cost so far and the leaf term. Paths that have come to one cell with one AoI of every user are one
path: the better one stays. The kept path ("trail") always survives, so the search never ends worse than it.
"""

from typing import NamedTuple

import numpy as np

from policy.model.compiled import compiled
from policy.search.moves import MoveTable, Walls
from policy.search.problem import Effort, Float32Array, Prices, Start, Users
from policy.world.arrays import BoolArray, FloatArray, IntArray

NO_MOVE = -1
ONE = np.float32(1.0)
ZERO = np.float32(0.0)
HALF = np.float32(0.5)
BINS = 256
LEAST_RANGE = 1e-9  # of ranks, for bins to tell them apart
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
    """K nodes of one depth, N as in :class:`policy.search.problem.Users`."""

    pos_m: FloatArray  # [K, 2]
    last: IntArray  # [K]
    cost: FloatArray  # [K]
    aoi_slots: Float32Array  # [K, N]


class Children(NamedTuple):
    """K A children in order of node and action, then the trail's; infinite cost and rank: not legal."""

    cost: FloatArray  # [K A + 1]
    leaf: FloatArray  # [K A + 1]
    rank: FloatArray  # [K A + 1] cost and leaf
    pos_m: FloatArray  # [K A + 1, 2]


EAST, NORTH, INNER, FADE, OTHERS, WEIGHT = range(6)
"""Rows of a crowd, float32 [6, N]: the users at the end of one slot, in one array so that the loops over users run
on vector units. OTHERS: metres from where the nearest other UAV serves for sure.
"""


@compiled
def search(scene: Scene, start: Start, trail: Trail, others_gap_m: Float32Array) -> Beam:
    """``others_gap_m`` [H, N]: metres from where the nearest other UAV serves for sure, 0 within."""
    users, prices, beam = scene.users, scene.prices, scene.effort.beam
    horizon, num_actions = users.east_m.shape[0], start.allowed.shape[1]
    parents, moves = np.zeros((horizon, beam), np.int64), np.zeros((horizon, beam), np.int64)
    places = np.zeros((horizon, beam, 2))
    layer = _root(start, users)
    leaf, discount, on_trail = np.zeros(1), 1.0, trail.length > 0
    for depth in range(horizon):
        crowd = _crowd(users, depth, others_gap_m[depth])
        leaf_price = discount * prices.discount * (prices.end if depth + 1 == horizon else prices.leaf)
        age_price = discount * (1.0 + (prices.last if depth + 1 == horizon else 0.0))
        children = _expand(scene, start, layer, crowd, trail, (depth, discount, age_price, leaf_price), on_trail)
        discount *= prices.discount
        last = children.rank.size - 1
        kept_first = NO_MOVE
        if on_trail:
            kept_first = last if depth < trail.length else _best_child(children.rank, num_actions)
        on_trail = kept_first != NO_MOVE
        chosen, aoi = _choose(scene, children, layer, crowd, kept_first)
        for place in range(chosen.size):
            child = chosen[place]
            parents[depth, place] = 0 if child == last else child // num_actions
            moves[depth, place] = trail.action[depth] if child == last else child % num_actions
            for axis in range(2):
                places[depth, place, axis] = children.pos_m[child, axis]
        kept = chosen.size
        layer = Layer(places[depth, :kept], moves[depth, :kept], _taken(children.cost, chosen), aoi)
        leaf = _taken(children.leaf, chosen)
    actions, path_m = _trace(parents, moves, places, layer.cost.size)
    return Beam(actions, path_m, layer.cost, leaf, layer.aoi_slots)


@compiled
def _taken(values: FloatArray, which: IntArray) -> FloatArray:
    """``values[which]``, by a loop: numba's own indexing by an array is far slower for a few."""
    taken = np.empty(which.size)
    for place in range(which.size):
        taken[place] = values[which[place]]
    return taken


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
    return Layer(start.pos_m.copy().reshape(1, 2), np.full(1, start.allowed.shape[1]), np.zeros(1), aoi)


@compiled
def _crowd(users: Users, depth: int, others_gap_m: Float32Array) -> Float32Array:
    crowd = np.empty((6, others_gap_m.size), np.float32)
    crowd[EAST], crowd[NORTH] = users.east_m[depth], users.north_m[depth]
    crowd[INNER], crowd[FADE] = users.inner_m[depth], users.fade_per_m[depth]
    crowd[OTHERS], crowd[WEIGHT] = others_gap_m, users.weight
    return crowd


@compiled
def _expand(
    scene: Scene,
    start: Start,
    layer: Layer,
    crowd: Float32Array,
    trail: Trail,
    when: tuple[int, float, float, float],
    on_trail: bool,
) -> Children:
    """All moves of all nodes; ``when``: depth, discount, prices of a slot of age and, in the leaf, of a metre to go."""
    depth, discount, age_price, leaf_price = when
    nodes, num_actions = layer.last.size, start.allowed.shape[1]
    cost, leaf = np.full(nodes * num_actions + 1, np.inf), np.zeros(nodes * num_actions + 1)
    pos_m, waiting = np.zeros((nodes * num_actions + 1, 2)), np.zeros(crowd.shape[1], np.float32)
    count = scene.users.present
    cover, energy = scene.prices.cover / max(count, 1), scene.prices.energy
    # Of one node: its moves and, last, the trail's.
    to_m, spent_j = np.zeros((num_actions + 1, 2)), np.zeros(num_actions + 1)
    is_tried, sums = np.zeros(num_actions + 1, np.bool_), np.zeros((num_actions + 1, 3))
    legal = is_tried[:num_actions]
    for node in range(nodes):
        place, last, so_far = (layer.pos_m[node, 0], layer.pos_m[node, 1]), layer.last[node], layer.cost[node]
        for user in range(waiting.size):
            waiting[user] = crowd[WEIGHT, user] * layer.aoi_slots[node, user]
        if scene.walls.box_m.shape[0] == 0 and last < num_actions:  # as _legal does, which is far dearer to call
            _keep_inside(scene, start.allowed[last], place, last, legal)
        else:
            legal[:] = _legal(scene, start, place, last)
        step_m, energy_j = start.step_m[last], start.energy_j[last]
        is_beside = scene.effort.free_places and scene.effort.by_velocity  # the trail's velocity is none of the table's
        if is_beside and on_trail and node == 0 and 0 < depth <= trail.length:
            step_m = _steps_from(scene.table, trail.vel_mps[depth - 1], legal)
        for action in range(num_actions):
            to_m[action, 0], to_m[action, 1] = place[0] + step_m[action, 0], place[1] + step_m[action, 1]
            spent_j[action] = energy_j[action]
        is_tried[num_actions] = node == 0 and depth < trail.length
        if is_tried[num_actions]:
            east, north = trail.path_m[depth, 0], trail.path_m[depth, 1]
            to_m[num_actions, 0], to_m[num_actions, 1] = east, north
            spent_j[num_actions] = energy_j[trail.action[depth]]
            if scene.effort.free_places:
                spent_j[num_actions] = _cruise_j(scene.table, np.hypot(east - place[0], north - place[1]))
        _outlooks(crowd, waiting, to_m, is_tried, sums)
        for action in range(num_actions + 1):
            if is_tried[action]:
                child = node * num_actions + action if action < num_actions else nodes * num_actions
                age, wait, missed = sums[action, 0], sums[action, 1], sums[action, 2]
                pos_m[child, 0], pos_m[child, 1] = to_m[action, 0], to_m[action, 1]
                cost[child] = (
                    so_far + age_price * age + discount * (energy * spent_j[action] - cover * (count - missed))
                )
                leaf[child] = leaf_price * wait
    return Children(cost, leaf, cost + leaf, pos_m)


@compiled
def _steps_from(table: MoveTable, vel_mps: FloatArray, legal: BoolArray) -> FloatArray:
    """Displacements [A, 2] from a velocity that is none of the table's (policy.world.motion.slot_motion); strikes
    the moves that cannot be reached in a slot.
    """
    num_actions = legal.size
    step_m = np.zeros((num_actions, 2))
    for action in range(num_actions):
        d_e, d_n = table.vel_mps[action, 0] - vel_mps[0], table.vel_mps[action, 1] - vel_mps[1]
        e_e, e_n = (
            table.end_mps[action, 0] - table.vel_mps[action, 0],
            table.end_mps[action, 1] - table.vel_mps[action, 1],
        )
        change_s = np.sqrt(d_e * d_e + d_n * d_n) / table.max_accel_mps2
        turn_s = np.sqrt(e_e * e_e + e_n * e_n) / table.max_accel_mps2
        step_m[action, 0] = table.vel_mps[action, 0] * table.slot_s - 0.5 * (change_s * d_e - turn_s * e_e)
        step_m[action, 1] = table.vel_mps[action, 1] * table.slot_s - 0.5 * (change_s * d_n - turn_s * e_n)
        legal[action] = legal[action] and (action == 0 or change_s + turn_s <= table.slot_s)
    return step_m


@compiled
def _cruise_j(table: MoveTable, way_m: float) -> float:
    """Energy of a slot at the steady speed that covers ``way_m``."""
    at = min(way_m / table.cruise_step_m, table.cruise_j.size - 1.0)
    low = min(int(at), table.cruise_j.size - 2)
    return float(table.cruise_j[low] + (at - low) * (table.cruise_j[low + 1] - table.cruise_j[low]))


@compiled
def _outlooks(
    crowd: Float32Array, waiting: Float32Array, to_m: FloatArray, is_tried: BoolArray, sums: FloatArray
) -> None:
    """Weighted sums over users after a slot that ends at each of the places [P, 2] that are tried, into ``sums``
    [P, 3]: AoI (Eq. 4), AoI x metres to reach, number missed. All moves of a node in one call: each call has its price.
    """
    for place in range(is_tried.size):
        if not is_tried[place]:
            continue
        east_m, north_m = np.float32(to_m[place, 0]), np.float32(to_m[place, 1])
        age, wait, missed = ZERO, ZERO, ZERO
        for user in range(waiting.size):
            d_east, d_north = crowd[EAST, user] - east_m, crowd[NORTH, user] - north_m
            gap = max(np.sqrt(d_east * d_east + d_north * d_north) - crowd[INNER, user], ZERO)
            gap = min(gap, crowd[OTHERS, user])
            miss = min(gap * crowd[FADE, user], ONE)
            aged = crowd[WEIGHT, user] + miss * waiting[user]
            age += aged
            wait += aged * gap
            missed += miss
        sums[place, 0], sums[place, 1], sums[place, 2] = age, wait, missed


@compiled
def _best_child(rank: FloatArray, num_actions: int) -> int:
    """How the trail goes on where it is open: the best child of node 0."""
    child = np.argmin(rank[:num_actions])
    return int(child) if np.isfinite(rank[child]) else NO_MOVE


@compiled
def _choose(
    scene: Scene, children: Children, layer: Layer, crowd: Float32Array, kept_first: int
) -> tuple[IntArray, Float32Array]:
    """The best children without duplicates in order of rank, the trail's before all, and their AoI."""
    effort, salt = scene.effort, scene.users.salt
    order = _best(children.rank, SHORTLIST * effort.beam)
    last = children.rank.size - 1
    num_actions = last // layer.last.size
    chosen, codes = np.zeros(effort.beam, np.int64), np.zeros(effort.beam, np.int64)
    aoi = np.zeros((effort.beam, layer.aoi_slots.shape[1]), np.float32)
    kept = 0
    for place in range(-1, order.size):
        child = kept_first if place < 0 else order[place]
        if child == NO_MOVE or (place >= 0 and child == kept_first):
            continue
        if kept == effort.beam:
            break
        east, north = children.pos_m[child, 0], children.pos_m[child, 1]
        parent = 0 if child == last else child // num_actions
        code = _renew(crowd, salt, layer.aoi_slots[parent], np.float32(east), np.float32(north), aoi[kept])
        code = _mix(_mix(code, np.floor(east / effort.cell_m)), np.floor(north / effort.cell_m))
        code = _mix(code, scene.table.end_index[child % num_actions]) if effort.by_velocity else code
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
    crowd: Float32Array,
    salt: IntArray,
    aoi: Float32Array,
    east_m: np.float32,
    north_m: np.float32,
    new_aoi: Float32Array,
) -> np.int64:
    """Write the AoI after the slot (Eq. 4, expected) into ``new_aoi`` [N] and return a hash of it."""
    for user in range(aoi.size):
        d_east, d_north = crowd[EAST, user] - east_m, crowd[NORTH, user] - north_m
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - crowd[INNER, user], ZERO)
        new_aoi[user] = ONE + min(min(gap, crowd[OTHERS, user]) * crowd[FADE, user], ONE) * aoi[user]
    code = np.int64(0)
    for user in range(aoi.size):
        code += np.int64(np.int32(new_aoi[user] + HALF)) * salt[user]
    return code


@compiled
def _mix(code: np.int64, value: float) -> np.int64:
    """Fold one more number into a hash."""
    code = (code ^ (code >> np.int64(29))) * HASH_STEP
    return code + np.int64(value) * HASH_SPREAD


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
    _keep_inside(scene, start.allowed[last], pos_m, last, legal)
    walls = scene.walls
    if walls.box_m.shape[0] == 0:
        return legal
    for action in range(legal.size):
        for obstacle in range(walls.box_m.shape[0]):
            legal[action] = legal[action] and not _hits(scene, pos_m, last, action, obstacle)
    legal[0] = legal[0] or not np.any(legal)
    return legal


@compiled
def _keep_inside(scene: Scene, allowed: BoolArray, pos_m: tuple[float, float], last: int, legal: BoolArray) -> None:
    """Which of the allowed moves [A] stay within the area on all of their way, into ``legal``; braking if none does."""
    low_m, high_m, box_m = scene.walls.low_m, scene.walls.high_m, scene.table.box_m
    west, south, east, north = low_m[0] - pos_m[0], low_m[1] - pos_m[1], high_m[0] - pos_m[0], high_m[1] - pos_m[1]
    is_any = False
    for action in range(legal.size):
        in_east = (box_m[last, action, 0] >= west) & (box_m[last, action, 2] <= east)
        in_north = (box_m[last, action, 1] >= south) & (box_m[last, action, 3] <= north)
        legal[action] = allowed[action] & in_east & in_north
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
