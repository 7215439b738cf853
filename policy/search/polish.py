"""Plans between the moves of the table: each place of each path is shifted, alone or with its neighbours, to where the
whole fleet's price is least (the paper's motion only, where a slot's way is any within reach).

The expected AoI of a user obeys a' = 1 + m a with m the chance to be missed in the slot (Eq. 4), so the price of all
that follows a slot is linear in its ages. One pass backward gives those slopes, one pass forward shifts the places:
exact coordinate descent, for the cost of one sum over users a place tried.
"""

from typing import NamedTuple

import numpy as np

from policy.search.compiled import compiled
from policy.search.kernel import Scene
from policy.search.moves import Walls
from policy.search.problem import Float32Array, Prices, Users
from policy.world.arrays import FloatArray, IntArray

ONE = np.float32(1.0)
ZERO = np.float32(0.0)
RINGS_M = (5.0, 15.0, 40.0, 90.0, 170.0)
DIRECTIONS = 10
GOLDEN_RAD = 2.399963229728653
"""Turns each ring's directions so that no two slots and sweeps try the same ones."""
LEAST_GAIN = 1e-7


EAST, NORTH, INNER, FADE, OTHERS, PER_SLOT, PER_SLOT_METRE = range(7)
"""Rows of a crowd, float32 [7, N]: the users at the end of one slot, and what their ages cost from there on, by slot
of age and by slot of age and metre to go.
"""


def _rings() -> FloatArray:
    angle = np.arange(DIRECTIONS) * 2.0 * np.pi / DIRECTIONS + GOLDEN_RAD * np.arange(len(RINGS_M))[:, None]
    rings = np.asarray(RINGS_M)[:, None, None] * np.stack((np.sin(angle), np.cos(angle)), axis=-1)
    return np.asarray(rings.reshape(-1, 2), dtype=np.float64)


OFFSETS_M = _rings()


@compiled
def polish(scene: Scene, start_m: FloatArray, path_m: FloatArray, order: IntArray, reach_m: float, sweeps: int) -> None:
    """Improve ``path_m`` [U, H, 2] in place for the UAVs in ``order``; others stay. ``start_m`` [U, 2]."""
    gap_m = np.full((path_m.shape[0], *scene.users.east_m.shape), np.float32(np.inf), np.float32)
    for uav in order:
        for depth in range(path_m.shape[1]):
            _gaps(scene.users, depth, path_m[uav, depth, 0], path_m[uav, depth, 1], gap_m[uav, depth])
    for sweep in range(sweeps):
        for uav in order:
            others = np.full(gap_m.shape[1:], np.float32(np.inf), np.float32)
            for other in order:
                if other != uav:
                    others = np.minimum(others, gap_m[other])
            _sweep(scene, Around(start_m[uav], others, reach_m), path_m[uav], gap_m[uav], sweep)


@compiled
def joint_price(
    scene: Scene, path_m: FloatArray, energy_j: FloatArray, order: IntArray
) -> tuple[float, float, Float32Array]:
    """Plans ``path_m`` [U, H, 2] of the UAVs in ``order``: (price of the horizon, of what comes after, ages [N]).

    ``energy_j`` [H] is what all of them spend together.
    """
    users, prices = scene.users, scene.prices
    horizon, count = users.east_m.shape
    aoi, gap = users.aoi_slots.copy(), np.zeros(count, np.float32)
    own = np.zeros(count, np.float32)
    total, discount = 0.0, 1.0
    for depth in range(horizon):
        gap[:] = np.float32(np.inf)
        for uav in order:
            _gaps(users, depth, path_m[uav, depth, 0], path_m[uav, depth, 1], own)
            gap = np.minimum(gap, own)
        age, served = 0.0, 0.0
        for user in range(count):
            miss = min(gap[user] * users.fade_per_m[depth, user], ONE)
            aoi[user] = ONE + miss * aoi[user]
            age += users.weight[user] * aoi[user]
            served += ONE - miss
        total += discount * (age - prices.cover * served / max(count, 1) + prices.energy * energy_j[depth])
        discount *= prices.discount
    after = 0.0
    for user in range(count):
        if prices.end > 0.0:
            after += discount * prices.end * users.weight[user] * aoi[user] * gap[user]
    return total, after, aoi


@compiled
def _gaps(users: Users, depth: int, east_m: float, north_m: float, gap_m: Float32Array) -> None:
    east, north = np.float32(east_m), np.float32(north_m)
    for user in range(gap_m.size):
        d_east, d_north = users.east_m[depth, user] - east, users.north_m[depth, user] - north
        gap_m[user] = max(np.sqrt(d_east * d_east + d_north * d_north) - users.inner_m[depth, user], ZERO)


class Around(NamedTuple):
    """What one UAV's path is tried in."""

    start_m: FloatArray  # [2]
    others_gap_m: Float32Array  # [H, N]
    reach_m: float


@compiled
def _sweep(scene: Scene, around: Around, path_m: FloatArray, own_gap_m: Float32Array, sweep: int) -> None:
    """One pass along one UAV's path; blocks of one place and of two by turns."""
    users, prices = scene.users, scene.prices
    horizon = users.east_m.shape[0]
    slope = _slopes(users, prices, np.minimum(own_gap_m, around.others_gap_m))
    aoi = users.aoi_slots.copy()
    for depth in range(horizon):
        last = min(depth + sweep % 2, horizon - 1)
        _shift(scene, around, path_m, (depth, last, sweep), aoi, slope[last])
        for slot in range(depth, last + 1):
            _gaps(users, slot, path_m[slot, 0], path_m[slot, 1], own_gap_m[slot])
        for user in range(aoi.size):
            gap = min(own_gap_m[depth, user], around.others_gap_m[depth, user])
            aoi[user] = ONE + min(gap * users.fade_per_m[depth, user], ONE) * aoi[user]
        if last > depth:
            slope = _slopes(users, prices, np.minimum(own_gap_m, around.others_gap_m))


@compiled
def _shift(
    scene: Scene,
    around: Around,
    path_m: FloatArray,
    where: tuple[int, int, int],
    aoi: Float32Array,
    slope: Float32Array,
) -> None:
    """Move the block of places from slot ``depth`` to ``last`` to the best of those around it."""
    depth, last, sweep = where
    users, prices = scene.users, scene.prices
    discount = prices.discount**last
    then = _crowd(users, last, around.others_gap_m[last])
    then[PER_SLOT] = np.float32(discount) * users.weight
    then[PER_SLOT_METRE] = ZERO
    then[PER_SLOT_METRE if last == users.east_m.shape[0] - 1 else PER_SLOT] += slope
    first = _crowd(users, depth, around.others_gap_m[depth])
    first[PER_SLOT] = np.float32(prices.discount**depth) * users.weight
    cover = np.float32(discount * prices.cover / max(aoi.size, 1))
    turn = GOLDEN_RAD * (7 * depth + 31 * sweep)
    cos, sin = np.cos(turn), np.sin(turn)
    ends = _ends(around, path_m, depth, last)
    bounds = _bounds(scene.walls, path_m[depth : last + 1])
    obstacles, cruise_j, cruise_step_m = scene.walls.box_m.shape[0], scene.table.cruise_j, scene.table.cruise_step_m
    energy_price = discount * prices.energy
    e_0, n_0, e_1, n_1 = path_m[depth, 0], path_m[depth, 1], path_m[last, 0], path_m[last, 1]
    best, best_e, best_n = np.inf, 0.0, 0.0
    for trial in range(-1, OFFSETS_M.shape[0]):
        d_e, d_n = 0.0, 0.0
        if trial >= 0:
            d_e = cos * OFFSETS_M[trial, 0] + sin * OFFSETS_M[trial, 1]
            d_n = cos * OFFSETS_M[trial, 1] - sin * OFFSETS_M[trial, 0]
            if d_e < bounds[0] or d_e > bounds[1] or d_n < bounds[2] or d_n > bounds[3]:
                continue
        in_2 = (e_0 + d_e - ends[0]) ** 2 + (n_0 + d_n - ends[1]) ** 2
        out_2 = (e_1 + d_e - ends[2]) ** 2 + (n_1 + d_n - ends[3]) ** 2 if ends[4] > 0.0 else 0.0
        if trial >= 0 and max(in_2, out_2) > around.reach_m * around.reach_m:
            continue
        if last == depth:
            price = _price_one(then, aoi, cover, np.float32(e_1 + d_e), np.float32(n_1 + d_n))
        else:
            place = np.float32(e_0 + d_e), np.float32(n_0 + d_n)
            price = _price_two(first, then, aoi, cover, place, (np.float32(e_1 + d_e), np.float32(n_1 + d_n)))
        if energy_price > 0.0:
            price += energy_price * _cruise_j(cruise_j, cruise_step_m, np.sqrt(in_2))
            price += energy_price * _cruise_j(cruise_j, cruise_step_m, np.sqrt(out_2)) if ends[4] > 0.0 else 0.0
        if price < best - LEAST_GAIN:
            if trial >= 0 and obstacles > 0 and not _clear(scene.walls, ends, path_m[depth : last + 1], (d_e, d_n)):
                continue
            best, best_e, best_n = price, d_e, d_n
    path_m[depth : last + 1, 0] += best_e
    path_m[depth : last + 1, 1] += best_n


@compiled
def _ends(around: Around, path_m: FloatArray, depth: int, last: int) -> tuple[float, float, float, float, float]:
    """The places before and after a block, east and north each, and 1 where there is one after it."""
    before_e, before_n = around.start_m[0], around.start_m[1]
    if depth > 0:
        before_e, before_n = path_m[depth - 1, 0], path_m[depth - 1, 1]
    if last + 1 == path_m.shape[0]:
        return before_e, before_n, 0.0, 0.0, 0.0
    return before_e, before_n, path_m[last + 1, 0], path_m[last + 1, 1], 1.0


@compiled
def _bounds(walls: Walls, places_m: FloatArray) -> tuple[float, float, float, float]:
    """How far a block may be shifted inside the area: west, east, south, north."""
    return (
        walls.low_m[0] - np.min(places_m[:, 0]),
        walls.high_m[0] - np.max(places_m[:, 0]),
        walls.low_m[1] - np.min(places_m[:, 1]),
        walls.high_m[1] - np.max(places_m[:, 1]),
    )


@compiled
def _crowd(users: Users, depth: int, others_gap_m: Float32Array) -> Float32Array:
    crowd = np.empty((7, others_gap_m.size), np.float32)
    crowd[EAST], crowd[NORTH] = users.east_m[depth], users.north_m[depth]
    crowd[INNER], crowd[FADE] = users.inner_m[depth], users.fade_per_m[depth]
    crowd[OTHERS] = others_gap_m
    return crowd


@compiled
def _slopes(users: Users, prices: Prices, gap_m: Float32Array) -> Float32Array:
    """What one slot of age of each user after slot t costs in slots after t: [H, N]; at the end, per metre."""
    horizon, count = gap_m.shape
    slope = np.zeros((horizon, count), np.float32)
    discount = np.float32(prices.discount**horizon)
    for user in range(count):
        slope[horizon - 1, user] = discount * np.float32(prices.end) * users.weight[user]
    for depth in range(horizon - 2, -1, -1):
        discount = np.float32(prices.discount ** (depth + 1))
        is_next_last = depth + 1 == horizon - 1
        for user in range(count):
            miss = min(gap_m[depth + 1, user] * users.fade_per_m[depth + 1, user], ONE)
            after = slope[depth + 1, user]
            if is_next_last:
                after *= gap_m[depth + 1, user] if miss > ZERO else ZERO
            slope[depth, user] = miss * (discount * users.weight[user] + after)
    return slope


@compiled
def _price_one(
    crowd: Float32Array, aoi: Float32Array, cover: np.float32, east_m: np.float32, north_m: np.float32
) -> float:
    """What depends on one place. ``aoi`` [N] before the slot, ``cover`` lost for each user missed."""
    total = ZERO
    for user in range(aoi.size):
        d_east, d_north = crowd[EAST, user] - east_m, crowd[NORTH, user] - north_m
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - crowd[INNER, user], ZERO)
        gap = min(gap, crowd[OTHERS, user])
        miss = min(gap * crowd[FADE, user], ONE)
        later = crowd[PER_SLOT, user] + crowd[PER_SLOT_METRE, user] * gap
        total += (ONE + miss * aoi[user]) * later + cover * miss
    return float(total)


@compiled
def _price_two(
    first: Float32Array,
    then: Float32Array,
    aoi: Float32Array,
    cover: np.float32,
    place_m: tuple[np.float32, np.float32],
    next_m: tuple[np.float32, np.float32],
) -> float:
    """What depends on two places in a row."""
    total = ZERO
    e_0, n_0 = place_m
    e_1, n_1 = next_m
    for user in range(aoi.size):
        d_east, d_north = first[EAST, user] - e_0, first[NORTH, user] - n_0
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - first[INNER, user], ZERO)
        miss = min(min(gap, first[OTHERS, user]) * first[FADE, user], ONE)
        age = ONE + miss * aoi[user]
        d_east, d_north = then[EAST, user] - e_1, then[NORTH, user] - n_1
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - then[INNER, user], ZERO)
        gap = min(gap, then[OTHERS, user])
        miss_1 = min(gap * then[FADE, user], ONE)
        later = then[PER_SLOT, user] + then[PER_SLOT_METRE, user] * gap
        total += first[PER_SLOT, user] * age + (ONE + miss_1 * age) * later + cover * (miss + miss_1)
    return float(total)


@compiled
def _cruise_j(cruise_j: FloatArray, step_m: float, way_m: float) -> float:
    """Energy of a slot at the steady speed that covers ``way_m``."""
    at = min(way_m / step_m, cruise_j.size - 1.0)
    low = min(int(at), cruise_j.size - 2)
    return float(cruise_j[low] + (at - low) * (cruise_j[low + 1] - cruise_j[low]))


@compiled
def _clear(
    walls: Walls, ends: tuple[float, float, float, float, float], places_m: FloatArray, by_m: tuple[float, float]
) -> bool:
    """Every way to, within and from a block that is shifted ``by_m`` keeps clear of all obstacles."""
    from_m = ends[0], ends[1]
    for index in range(places_m.shape[0] + 1):
        to_m = ends[2], ends[3]
        if index < places_m.shape[0]:
            to_m = places_m[index, 0] + by_m[0], places_m[index, 1] + by_m[1]
        elif ends[4] == 0.0:
            break
        for obstacle in range(walls.box_m.shape[0]):
            if _blocked(walls, obstacle, from_m, to_m):
                return False
        from_m = to_m
    return True


@compiled
def _blocked(walls: Walls, obstacle: int, from_m: tuple[float, float], to_m: tuple[float, float]) -> bool:
    """The straight way comes within the margin of an obstacle, or one of its ends lies in it."""
    box = walls.box_m[obstacle]
    if max(from_m[0], to_m[0]) < box[0] or max(from_m[1], to_m[1]) < box[1]:
        return False
    if min(from_m[0], to_m[0]) > box[2] or min(from_m[1], to_m[1]) > box[3]:
        return False
    corners = walls.corner_m[walls.first[obstacle] : walls.first[obstacle + 1]]
    inside = False
    for index in range(corners.shape[0]):
        e0, n0 = corners[index]
        e1, n1 = corners[(index + 1) % corners.shape[0]]
        if (n0 > to_m[1]) != (n1 > to_m[1]) and to_m[0] < e0 + (to_m[1] - n0) * (e1 - e0) / (n1 - n0):
            inside = not inside
        if _cross(from_m, to_m, (e0, n0), (e1, n1)):
            return True
        least_2 = min(_away_2(from_m, (e0, n0), (e1, n1)), _away_2(to_m, (e0, n0), (e1, n1)))
        least_2 = min(least_2, _away_2((e0, n0), from_m, to_m), _away_2((e1, n1), from_m, to_m))
        if least_2 <= walls.margin_m * walls.margin_m:
            return True
    return inside


@compiled
def _away_2(point_m: tuple[float, float], from_m: tuple[float, float], to_m: tuple[float, float]) -> float:
    """Squared distance of a point from a segment."""
    along_e, along_n = to_m[0] - from_m[0], to_m[1] - from_m[1]
    length_2 = along_e * along_e + along_n * along_n
    share = ((point_m[0] - from_m[0]) * along_e + (point_m[1] - from_m[1]) * along_n) / max(length_2, 1e-12)
    share = min(max(share, 0.0), 1.0)
    return (point_m[0] - from_m[0] - share * along_e) ** 2 + (point_m[1] - from_m[1] - share * along_n) ** 2


@compiled
def _cross(
    a_m: tuple[float, float], b_m: tuple[float, float], c_m: tuple[float, float], d_m: tuple[float, float]
) -> bool:
    """Two segments cross: each one's ends lie on both sides of the other."""
    return (_side(a_m, b_m, c_m) > 0.0) != (_side(a_m, b_m, d_m) > 0.0) and (_side(c_m, d_m, a_m) > 0.0) != (
        _side(c_m, d_m, b_m) > 0.0
    )


@compiled
def _side(a_m: tuple[float, float], b_m: tuple[float, float], p_m: tuple[float, float]) -> float:
    return (b_m[0] - a_m[0]) * (p_m[1] - a_m[1]) - (b_m[1] - a_m[1]) * (p_m[0] - a_m[0])
