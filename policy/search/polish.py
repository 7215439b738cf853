"""Plans between the moves of the table: each place of each path is shifted, alone or with its neighbours, to where the
whole fleet's price is least.

The expected AoI of a user obeys a' = 1 + m a with m the chance to be missed in the slot (Eq. 4), so the price of all
that follows a slot is linear in its ages. One pass backward gives those slopes, one pass forward shifts the places:
exact coordinate descent, for the cost of one sum over users a place tried.

A slot's way is a *leg*: from a place and velocity, at one cruising velocity, into the place and velocity at which it
ends (``policy.world.motion.slot_motion``). Legs meet at a place and its velocity only, so with inertia too a shift
concerns no more than the legs beside it. A turn is shared by the two, or all of it is in the one that has time for it.

Polishing may also be *heated*: at a temperature above zero a place goes by chance to one of those tried, the more
likely the cheaper it is (a heat bath). A falling temperature leads out of plans that no single shift improves.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from policy.model.compiled import compiled
from policy.search.kernel import NO_MOVE, Draft, Scene
from policy.search.moves import Walls
from policy.search.problem import VECTOR, Float32Array, Prices, Users
from policy.world import motion
from policy.world.arrays import FloatArray, IntArray

ONE = np.float32(1.0)
ZERO = np.float32(0.0)
RINGS_M = (5.0, 15.0, 40.0, 90.0, 170.0)
SHIFT_M = np.float32(RINGS_M[-1] + 0.01)
"""No place is shifted farther at once, float32 rounding included."""
DIRECTIONS = 10
GOLDEN_RAD = 2.399963229728653
"""Turns each ring's directions so that no two slots and sweeps try the same ones."""
LEAST_GAIN = 1e-7
HASH_STEP = np.int64(6364136223846793005)  # Knuth's multiplier (MMIX)
HASH_SPREAD = np.int64(1442695040888963407)
CHANCES = 4096
GUMBEL = -np.log(-np.log((np.arange(CHANCES) + 0.5) / CHANCES))
"""Quantiles of Gumbel's distribution: the least of prices less such noise is a draw of Boltzmann's."""
STRAIGHT_STEPS = 3
NEWTON_STEPS = 12
SHORTER_STEPS = 6
MOST_STEP_MPS = 8.0
FASTEST_SHARE = 1.3
"""Of the greatest speed: how fast a cruise may be on the way to its solution."""
SLOPE_MPS = 1e-4
"""Over which slopes of a leg's way are taken."""
ROUNDING = 1e-4
"""By what share a solution may be faster than allowed: it is flown no faster, for a few centimetres of its way."""
NOT_FLYABLE, AS_IT_IS, TURNS_SHARED, TURNS_BEFORE, TURNS_AFTER = range(5)
"""How a shifted block can be flown: not, with its velocities as they are, or with those that leave half of each turn to
the slot before a place and half to the one after it, all to the one before, or all to the one after.
"""
FULL_SPEED_CHORD = 4.0
"""Times the mean velocity over two slots is how fast the place between them is passed at most: at the speed of the ways
beside it up to turns of 150 degrees, at rest in a reversal (what leads nearest to the corner by hand, within 1 m).
"""
REVERSAL_RAD, SLOW_SHARE, STRAIGHT_RAD, TINY = motion.REVERSAL_RAD, motion.SLOW_SHARE, motion.STRAIGHT_RAD, motion.TINY
CHORD_S = 1.0
"""A chord of a turn: at 4.5 m/s2 the turn leaves it by 0.6 m."""
LEG_MISS_M = 1e-3
"""A leg ends this near to where it is to end."""


EAST, NORTH, INNER, FADE, OTHERS, PER_SLOT, PER_SLOT_METRE = range(7)
"""Rows of a crowd, float32 [7, N]: the users at the end of one slot, and what their ages cost from there on, by slot
of age and by slot of age and metre to go.
"""
FIRST, THEN = range(2)
"""Crowds of a block."""


def _rings() -> FloatArray:
    angle = np.arange(DIRECTIONS) * 2.0 * np.pi / DIRECTIONS + GOLDEN_RAD * np.arange(len(RINGS_M))[:, None]
    rings = np.asarray(RINGS_M)[:, None, None] * np.stack((np.sin(angle), np.cos(angle)), axis=-1)
    return np.asarray(rings.reshape(-1, 2), dtype=np.float64)


OFFSETS_M = _rings()


class Legs(NamedTuple):
    """What a vehicle can do in a slot."""

    slot_s: float
    max_speed_mps: float
    max_accel_mps2: float  # infinite: the paper's motion, velocities mean nothing


class Heat(NamedTuple):
    """How much chance there is in polishing."""

    slots: FloatArray  # [S] temperature of each sweep, in the unit of the price; 0: to the cheapest place
    seed: int


class Paths(NamedTuple):
    """Where U UAVs are now and at the end of each slot, and how fast."""

    start_m: FloatArray  # [U, 2]
    start_mps: FloatArray  # [U, 2]
    place_m: FloatArray  # [U, H, 2]
    vel_mps: FloatArray  # [U, H, 2]


class Around(NamedTuple):
    """What one UAV's path is tried in."""

    start_m: FloatArray  # [2]
    start_mps: FloatArray  # [2]
    vel_mps: FloatArray  # [H, 2] at the slots' ends, shifted with the places
    others_gap_m: Float32Array  # [H, N]
    legs: Legs
    heat_slots: float
    chance: np.int64  # differs between sweeps and UAVs


class Desk(NamedTuple):
    """What a polish reads often and writes on: to have it anew for each block costs more than its sums."""

    age_price: FloatArray  # [H] of a slot of everyone's age at the end of each slot
    slope: Float32Array  # [H, N] see ``_take_slopes``
    aoi_slots: Float32Array  # [N] as the sweep goes
    age: Float32Array  # [N] the same of those in play
    crowds: Float32Array  # [2, 7, N] of a block's first slot, where it has two, and of its last
    matters: npt.NDArray[np.int32]  # [N]
    who: npt.NDArray[np.uint32]  # [N] users in play, the first of it


@compiled
def take_up(
    scene: Scene,
    start: tuple[FloatArray, FloatArray],
    kept: tuple[IntArray, FloatArray, FloatArray],
    draft: Draft,
    order: IntArray,
    legs: Legs,
) -> None:
    """Put kept plans into an empty draft as far as they can still be flown.

    ``start``: places and velocities [U, 2] now; ``kept``: actions [U, >= 1], places and velocities [U, >= 1, 2].
    """
    actions, path_m, vel_mps = kept
    horizon = draft.actions.shape[1]
    for uav in order:
        length = 0
        while length < min(horizon, actions.shape[1]) and actions[uav, length] != NO_MOVE:
            length += 1
        if length == 0:
            continue
        draft.path_m[uav, :length], draft.vel_mps[uav, :length] = path_m[uav, :length], vel_mps[uav, :length]
        length = keep_up(scene.walls, legs, start[0][uav], start[1][uav], draft.path_m[uav], draft.vel_mps[uav], length)
        for slot in range(horizon):
            draft.actions[uav, slot] = actions[uav, slot] if slot < length else 0
            if slot >= length:
                draft.path_m[uav, slot] = draft.path_m[uav, length - 1] if length > 0 else start[0][uav]
        draft.length[uav] = length  # its open end stays open for the search to fill
        path_gap_m = draft.gap_m[uav]
        for slot in range(horizon):
            _gaps(scene.users, slot, draft.path_m[uav, slot, 0], draft.path_m[uav, slot, 1], path_gap_m)


@compiled
def polish_and_price(
    scene: Scene, paths: Paths, gap_m: Float32Array, order: IntArray, legs: Legs, heat: Heat
) -> tuple[float, float, Float32Array]:
    """``polish``, ``ways_j`` and ``joint_price`` in one call: each call has its price."""
    if scene.users.aoi_slots.size > 0:
        polish(scene, paths, gap_m, order, legs, heat)
    return joint_price(scene, paths.place_m, ways_j(scene, paths.start_m, paths.place_m, order), order)


@compiled
def polish(scene: Scene, paths: Paths, gap_m: Float32Array, order: IntArray, legs: Legs, heat: Heat) -> None:
    """Change ``paths`` in place for the UAVs in ``order``, for the better where there is no heat; others stay.

    ``gap_m`` [U, H, N] is written: metres from where each of them serves for sure to each user; it must be infinite
    for the others.
    """
    horizon, count = scene.users.east_m.shape
    for uav in order:
        path_m, own_gap_m = paths.place_m[uav], gap_m[uav]
        for depth in range(horizon):
            _gaps(scene.users, depth, path_m[depth, 0], path_m[depth, 1], own_gap_m)
    desk = make_desk(scene.prices, horizon, count)
    others = np.empty((horizon, count), np.float32)
    for sweep in range(heat.slots.size):
        for uav in order:
            _nearest_other(gap_m, order, uav, others)
            chance = _mix(_mix(np.int64(heat.seed), sweep), uav)
            around = Around(
                paths.start_m[uav], paths.start_mps[uav], paths.vel_mps[uav], others, legs, heat.slots[sweep], chance
            )
            _sweep(scene, around, desk, paths.place_m[uav], gap_m[uav], sweep)


@compiled
def make_desk(prices: Prices, horizon: int, count: int) -> Desk:
    """An empty one for H slots and N users."""
    age_price = np.empty(horizon)
    for depth in range(horizon):
        age_price[depth] = _age_price(prices, depth, horizon)
    return Desk(
        age_price,
        np.empty((horizon, count), np.float32),
        np.empty(count, np.float32),
        np.empty(count, np.float32),
        np.zeros((2, 7, count), np.float32),
        np.empty(count, np.int32),
        np.empty(count, np.uint32),
    )


@compiled
def _nearest_other(gap_m: Float32Array, order: IntArray, uav: int, others_gap_m: Float32Array) -> None:
    """The least of the other UAVs' gaps [U, H, N], into [H, N]."""
    others_gap_m[:] = np.float32(np.inf)
    for other in order:
        if other != uav:
            for depth in range(others_gap_m.shape[0]):
                for user in range(others_gap_m.shape[1]):
                    others_gap_m[depth, user] = min(others_gap_m[depth, user], gap_m[other, depth, user])


@compiled
def ways_j(scene: Scene, start_m: FloatArray, path_m: FloatArray, order: IntArray) -> FloatArray:
    """What UAVs on free places spend in each slot together [H]: steady flight over the ways between them."""
    energy_j = np.zeros(path_m.shape[1])
    for uav in order:
        east, north = start_m[uav, 0], start_m[uav, 1]
        for depth in range(path_m.shape[1]):
            d_e, d_n = path_m[uav, depth, 0] - east, path_m[uav, depth, 1] - north
            way_m = np.sqrt(d_e * d_e + d_n * d_n)
            energy_j[depth] += _cruise_j(scene.table.cruise_j, scene.table.cruise_step_m, way_m)
            east, north = path_m[uav, depth, 0], path_m[uav, depth, 1]
    return energy_j


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
    total, discount = 0.0, 1.0
    for depth in range(horizon):
        gap[:] = np.float32(np.inf)
        for uav in order:
            _take_nearer(users, depth, path_m[uav, depth, 0], path_m[uav, depth, 1], gap)
        age, missed = 0.0, 0.0
        for user in range(count):
            miss = min(gap[user] * users.fade_per_m[depth, user], ONE)
            aoi[user] = ONE + miss * aoi[user]
            age += users.weight[user] * aoi[user]
            missed += miss
        served = (users.present - missed) / max(users.present, 1)
        total += _age_price(prices, depth, horizon) * age
        total += discount * (prices.energy * energy_j[depth] - prices.cover * served)
        discount *= prices.discount
    after = 0.0
    for user in range(count):
        if prices.end > 0.0:
            after += discount * prices.end * users.weight[user] * aoi[user] * gap[user]
    return total, after, aoi


@compiled
def _age_price(prices: Prices, depth: int, horizon: int) -> float:
    """Of a slot of everyone's age at the end of a slot."""
    return float(prices.discount**depth * (1.0 + (prices.last if depth + 1 == horizon else 0.0)))


@compiled
def _gaps(users: Users, depth: int, east_m: float, north_m: float, gap_m: Float32Array) -> None:
    """Of one place, into a row of ``gap_m`` [H, N]."""
    east, north = np.float32(east_m), np.float32(north_m)
    for user in range(gap_m.shape[1]):
        d_east, d_north = users.east_m[depth, user] - east, users.north_m[depth, user] - north
        gap_m[depth, user] = max(np.sqrt(d_east * d_east + d_north * d_north) - users.inner_m[depth, user], ZERO)


@compiled
def _take_nearer(users: Users, depth: int, east_m: float, north_m: float, gap_m: Float32Array) -> None:
    """Lower gaps [N] to those of one place, where these are less."""
    east, north = np.float32(east_m), np.float32(north_m)
    for user in range(gap_m.size):
        d_east, d_north = users.east_m[depth, user] - east, users.north_m[depth, user] - north
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - users.inner_m[depth, user], ZERO)
        gap_m[user] = min(gap_m[user], gap)


@compiled
def _sweep(scene: Scene, around: Around, desk: Desk, path_m: FloatArray, own_gap_m: Float32Array, sweep: int) -> None:
    """One pass along one UAV's path; blocks of one place and of two by turns."""
    users, aoi = scene.users, desk.aoi_slots
    horizon = users.east_m.shape[0]
    # A slot's slopes come from the slots after it, which are not shifted before it: they hold for the whole sweep.
    _take_slopes(users, scene.prices, own_gap_m, around.others_gap_m, desk)
    aoi[:] = users.aoi_slots
    for depth in range(horizon):
        last = min(depth + sweep % 2, horizon - 1)
        if around.legs.max_accel_mps2 < np.inf:
            _share_turns(scene.walls, around, path_m, depth)
        _shift(scene, around, desk, path_m, (depth, last, sweep))
        for slot in range(depth, last + 1):
            _gaps(users, slot, path_m[slot, 0], path_m[slot, 1], own_gap_m)
        for user in range(aoi.size):
            gap = min(own_gap_m[depth, user], around.others_gap_m[depth, user])
            aoi[user] = ONE + min(gap * users.fade_per_m[depth, user], ONE) * aoi[user]


@compiled
def _shift(scene: Scene, around: Around, desk: Desk, path_m: FloatArray, where: tuple[int, int, int]) -> None:
    """Move the block of places from slot ``depth`` to ``last`` to the best of those around it."""
    depth, last, sweep = where
    users, prices = scene.users, scene.prices
    discount = prices.discount**last
    count = _lay_out(users, around.others_gap_m, desk, path_m, depth, last)
    cover = np.float32(discount * prices.cover / max(users.present, 1))
    turn = GOLDEN_RAD * (7 * depth + 31 * sweep)
    cos, sin = np.cos(turn), np.sin(turn)
    ends = _ends(around, path_m, depth, last)
    bounds = _bounds(scene.walls, path_m, depth, last)
    cruise_j, cruise_step_m = scene.table.cruise_j, scene.table.cruise_step_m
    energy_price = discount * prices.energy
    reach_2 = (around.legs.max_speed_mps * around.legs.slot_s) ** 2
    e_0, n_0, e_1, n_1 = path_m[depth, 0], path_m[depth, 1], path_m[last, 0], path_m[last, 1]
    best, best_e, best_n, best_manner = np.inf, 0.0, 0.0, AS_IT_IS
    for trial in range(-1, OFFSETS_M.shape[0]):
        d_e, d_n = 0.0, 0.0
        if trial >= 0:
            d_e = cos * OFFSETS_M[trial, 0] + sin * OFFSETS_M[trial, 1]
            d_n = cos * OFFSETS_M[trial, 1] - sin * OFFSETS_M[trial, 0]
        in_2 = (e_0 + d_e - ends[0]) ** 2 + (n_0 + d_n - ends[1]) ** 2
        out_2 = (e_1 + d_e - ends[2]) ** 2 + (n_1 + d_n - ends[3]) ** 2 if ends[4] > 0.0 else 0.0
        if trial >= 0 and (max(in_2, out_2) > reach_2 or not _within(bounds, d_e, d_n)):
            continue
        if last == depth:
            price = _price_one(desk, count, cover, np.float32(e_1 + d_e), np.float32(n_1 + d_n))
        else:
            place = np.float32(e_0 + d_e), np.float32(n_0 + d_n)
            price = _price_two(desk, count, cover, place, (np.float32(e_1 + d_e), np.float32(n_1 + d_n)))
        if energy_price > 0.0 and (price < best or around.heat_slots > 0.0):  # energy only adds to it
            price += energy_price * _cruise_j(cruise_j, cruise_step_m, np.sqrt(in_2))
            price += energy_price * _cruise_j(cruise_j, cruise_step_m, np.sqrt(out_2)) if ends[4] > 0.0 else 0.0
        if around.heat_slots > 0.0:
            price -= around.heat_slots * _noise(around.chance, depth, trial)
        if price < best - LEAST_GAIN:
            manner = AS_IT_IS if trial < 0 else _manner(scene.walls, around, path_m, (depth, last), (d_e, d_n))
            if manner != NOT_FLYABLE:
                best, best_e, best_n, best_manner = price, d_e, d_n, manner
    for slot in range(depth, last + 1):
        path_m[slot, 0] += best_e
        path_m[slot, 1] += best_n
    if best_manner != AS_IT_IS:
        for slot in range(depth, last + 1):
            around.vel_mps[slot] = _velocity_at(around, path_m, slot, (0, -1), (0.0, 0.0), best_manner)


@compiled
def _mix(code: np.int64, value: int) -> np.int64:
    """Fold a number into a hash."""
    code = (code ^ (code >> np.int64(29))) * HASH_STEP
    return code + np.int64(value + 1) * HASH_SPREAD


@compiled
def _noise(chance: np.int64, depth: int, trial: int) -> float:
    """One of Gumbel's quantiles by chance."""
    return float(GUMBEL[(_mix(_mix(chance, depth), trial) >> np.int64(40)) & np.int64(CHANCES - 1)])


@compiled
def _lay_out(users: Users, others_gap_m: Float32Array, desk: Desk, path_m: FloatArray, depth: int, last: int) -> int:
    """The users in play and what their ages cost, in whole vectors: how many."""
    count = _in_play(users, others_gap_m, path_m, depth, last, desk)
    crowds, horizon = desk.crowds, users.east_m.shape[0]
    at_end, then_price = last == horizon - 1, np.float32(desk.age_price[last])
    _crowd(users, last, others_gap_m, desk, count, THEN)
    for index in range(count):
        user = desk.who[index]
        after = desk.slope[last, user]
        desk.age[index] = desk.aoi_slots[user]
        crowds[THEN, PER_SLOT, index] = then_price * users.weight[user]
        crowds[THEN, PER_SLOT, index] += ZERO if at_end else after
        crowds[THEN, PER_SLOT_METRE, index] = after if at_end else ZERO
    if last > depth:
        _crowd(users, depth, others_gap_m, desk, count, FIRST)
        first_price = np.float32(desk.age_price[depth])
        for index in range(count):
            crowds[FIRST, PER_SLOT, index] = first_price * users.weight[desk.who[index]]
    whole = -(-count // VECTOR) * VECTOR
    for index in range(count, whole):
        desk.age[index] = ONE
        for row in range(crowds.shape[1]):
            crowds[FIRST, row, index] = crowds[THEN, row, index] = ZERO
    return whole


@compiled
def _within(bounds: tuple[float, float, float, float], d_e: float, d_n: float) -> bool:
    return bounds[0] <= d_e <= bounds[1] and bounds[2] <= d_n <= bounds[3]


@compiled
def _manner(walls: Walls, around: Around, path_m: FloatArray, block: tuple[int, int], by_m: tuple[float, float]) -> int:
    """How a shifted block can be flown, if at all; ways within reach of the paper's motion need no more than room."""
    if around.legs.max_accel_mps2 == np.inf:
        is_open = walls.box_m.shape[0] == 0
        return AS_IT_IS if is_open or _flyable(walls, around, path_m, block, by_m, AS_IT_IS) else NOT_FLYABLE
    for manner in (TURNS_SHARED, TURNS_BEFORE, TURNS_AFTER, AS_IT_IS):
        if _flyable(walls, around, path_m, block, by_m, manner):
            return manner
    return NOT_FLYABLE


@compiled
def _place(
    around: Around, path_m: FloatArray, slot: int, block: tuple[int, int], by_m: tuple[float, float]
) -> tuple[float, float]:
    """The place at the end of a slot (-1: now) when those of a block are shifted."""
    if slot < 0:
        return around.start_m[0], around.start_m[1]
    if block[0] <= slot <= block[1]:
        return path_m[slot, 0] + by_m[0], path_m[slot, 1] + by_m[1]
    return path_m[slot, 0], path_m[slot, 1]


@compiled
def _velocity_at(
    around: Around,
    path_m: FloatArray,
    slot: int,
    block: tuple[int, int],
    by_m: tuple[float, float],
    manner: int,
) -> tuple[float, float]:
    """The velocity at the end of a slot that turns in such a manner."""
    legs = around.legs
    before, here = _place(around, path_m, slot - 1, block, by_m), _place(around, path_m, slot, block, by_m)
    way_in = here[0] - before[0], here[1] - before[1]
    if manner == TURNS_AFTER or slot + 1 == path_m.shape[0]:
        return _no_faster((way_in[0] / legs.slot_s, way_in[1] / legs.slot_s), legs.max_speed_mps)
    after = _place(around, path_m, slot + 1, block, by_m)
    way_out = after[0] - here[0], after[1] - here[1]
    if manner == TURNS_BEFORE:
        return _no_faster((way_out[0] / legs.slot_s, way_out[1] / legs.slot_s), legs.max_speed_mps)
    mean_mps = (way_in[0] + way_out[0]) / (2.0 * legs.slot_s), (way_in[1] + way_out[1]) / (2.0 * legs.slot_s)
    speed_mps = 0.5 * (_apart(way_in, (0.0, 0.0)) + _apart(way_out, (0.0, 0.0))) / legs.slot_s
    chord_mps = _apart(mean_mps, (0.0, 0.0))
    share = min(FULL_SPEED_CHORD, min(speed_mps, legs.max_speed_mps) / max(chord_mps, TINY))
    return share * mean_mps[0], share * mean_mps[1]


@compiled
def _flyable(
    walls: Walls,
    around: Around,
    path_m: FloatArray,
    block: tuple[int, int],
    by_m: tuple[float, float],
    manner: int,
) -> bool:
    """All legs into, within and out of a shifted block can be flown: its velocities as they are, or turns shared."""
    place, vel = _place(around, path_m, block[0] - 1, block, by_m), (around.start_mps[0], around.start_mps[1])
    if block[0] > 0:
        vel = around.vel_mps[block[0] - 1, 0], around.vel_mps[block[0] - 1, 1]
    for slot in range(block[0], min(block[1] + 2, path_m.shape[0])):
        to_place, to_vel = _place(around, path_m, slot, block, by_m), (around.vel_mps[slot, 0], around.vel_mps[slot, 1])
        if manner != AS_IT_IS and slot <= block[1]:
            to_vel = _velocity_at(around, path_m, slot, block, by_m, manner)
        if not flies(walls, around.legs, place, vel, to_place, to_vel):
            return False
        place, vel = to_place, to_vel
    return True


@compiled
def _share_turns(walls: Walls, around: Around, path_m: FloatArray, slot: int) -> None:
    """Give a place the velocity that shares its turn, where that can be flown: room for shifts to come."""
    if _flyable(walls, around, path_m, (slot, slot), (0.0, 0.0), TURNS_SHARED):
        around.vel_mps[slot] = _velocity_at(around, path_m, slot, (slot, slot), (0.0, 0.0), TURNS_SHARED)


@compiled
def keep_up(
    walls: Walls,
    legs: Legs,
    start_m: FloatArray,
    start_mps: FloatArray,
    path_m: FloatArray,
    vel_mps: FloatArray,
    length: int,
) -> int:
    """How many slots of a kept plan can be flown from where the UAV really is: 0 to ``length``.

    Wind and lag leave a UAV beside its plan: its first places are then moved ([H, 2] in place) until it is back on it.
    """
    place, vel = (start_m[0], start_m[1]), (start_mps[0], start_mps[1])
    for slot in range(length):
        to_m, to_mps = (path_m[slot, 0], path_m[slot, 1]), (vel_mps[slot, 0], vel_mps[slot, 1])
        if not flies(walls, legs, place, vel, to_m, to_mps):
            to_mps = _velocity_to(legs, place, to_m)
            to_m = _end_of_leg(legs, place, vel, to_mps, to_mps)
            if not flies(walls, legs, place, vel, to_m, to_mps):
                return slot
            path_m[slot], vel_mps[slot] = to_m, to_mps
        place, vel = to_m, to_mps
    return length


@compiled
def _velocity_to(legs: Legs, from_m: tuple[float, float], to_m: tuple[float, float]) -> tuple[float, float]:
    """That covers the way in a slot, no faster than allowed."""
    east, north = (to_m[0] - from_m[0]) / legs.slot_s, (to_m[1] - from_m[1]) / legs.slot_s
    share = min(1.0, legs.max_speed_mps / max(np.sqrt(east * east + north * north), 1e-9))
    return share * east, share * north


@compiled
def _end_of_leg(
    legs: Legs,
    from_m: tuple[float, float],
    from_mps: tuple[float, float],
    cruise_mps: tuple[float, float],
    to_mps: tuple[float, float],
) -> tuple[float, float]:
    """Where a leg ends (policy.world.motion.slot_motion)."""
    way_e, way_n, _, _ = _leg(legs, from_mps, cruise_mps, to_mps)
    return from_m[0] + way_e, from_m[1] + way_n


@compiled
def _leg(
    legs: Legs, from_mps: tuple[float, float], cruise_mps: tuple[float, float], to_mps: tuple[float, float]
) -> tuple[float, float, tuple[float, float], tuple[float, float]]:
    """A leg's way, east and north, and its two turns: half of the bend and time of each."""
    first = turn(legs, from_mps, cruise_mps, legs.slot_s - _apart(cruise_mps, to_mps) / legs.max_accel_mps2)
    last = turn(legs, cruise_mps, to_mps, legs.slot_s - first[1])
    first_e, first_n = turn_way(from_mps, cruise_mps, first, 1.0)
    last_e, last_n = turn_way(cruise_mps, to_mps, last, 1.0)
    steady_s = legs.slot_s - first[1] - last[1]
    return first_e + cruise_mps[0] * steady_s + last_e, first_n + cruise_mps[1] * steady_s + last_n, first, last


@compiled
def turn(legs: Legs, from_mps: tuple[float, float], to_mps: tuple[float, float], most_s: float) -> tuple[float, float]:
    """policy.world.motion.make_turn: half of the angle that its arc bends by, and its time."""
    straight_s = _apart(from_mps, to_mps) / legs.max_accel_mps2
    cross = from_mps[0] * to_mps[1] - from_mps[1] * to_mps[0]
    angle_rad = np.arctan2(cross, from_mps[0] * to_mps[0] + from_mps[1] * to_mps[1])
    one, other = _apart(from_mps, (0.0, 0.0)), _apart(to_mps, (0.0, 0.0))
    bend = min(max((np.pi - abs(angle_rad)) / REVERSAL_RAD, 0.0), 1.0)
    bend *= min(min(one, other) / (SLOW_SHARE * max(one, other) + TINY), 1.0)
    half_rad = _bent(0.5 * angle_rad * bend)
    longer_s = straight_s * (half_rad / np.sin(half_rad)) - straight_s
    if longer_s > most_s - straight_s:
        half_rad = _bent(half_rad * max(most_s - straight_s, 0.0) / (longer_s + TINY))
        return half_rad, straight_s * (half_rad / np.sin(half_rad))
    return half_rad, straight_s + longer_s


@compiled
def _bent(half_rad: float) -> float:
    return half_rad if abs(half_rad) >= STRAIGHT_RAD else STRAIGHT_RAD


@compiled
def _apart(one: tuple[float, float], other: tuple[float, float]) -> float:
    east, north = other[0] - one[0], other[1] - one[1]
    return float(np.sqrt(east * east + north * north))


@compiled
def turn_way(
    from_mps: tuple[float, float], to_mps: tuple[float, float], bend: tuple[float, float], share: float
) -> tuple[float, float]:
    """Way after a share of a turn's time, east and north (policy.world.motion.turn_motion)."""
    half_rad, time_s = bend
    sin, cos = np.sin(half_rad), np.cos(half_rad)
    if share == 1.0:
        along, across = 0.5, 0.5 * (cos / sin - 1.0 / half_rad)
    else:
        bent = half_rad * share
        p, q = np.sin(2.0 * bent) / (2.0 * half_rad) - share, np.sin(bent) ** 2 / half_rad
        along, across = (cos * q - sin * p) / (2.0 * sin), -(cos * p + sin * q) / (2.0 * sin)
    d_e, d_n = to_mps[0] - from_mps[0], to_mps[1] - from_mps[1]
    return (
        time_s * (share * from_mps[0] + along * d_e - across * d_n),
        time_s * (share * from_mps[1] + along * d_n + across * d_e),
    )


@compiled
def flies(
    walls: Walls,
    legs: Legs,
    from_m: tuple[float, float],
    from_mps: tuple[float, float],
    to_m: tuple[float, float],
    to_mps: tuple[float, float],
) -> bool:
    """The leg is within the vehicle's limits, inside the area and clear of obstacles, with room to brake after it."""
    east, north, found = cruise(legs, from_m, from_mps, to_m, to_mps)
    if not found:
        return False
    if legs.max_accel_mps2 == np.inf:
        return _inside(walls, to_m) and not _meets(walls, from_m, to_m)
    cruise_mps = east, north
    _, _, first, last = _leg(legs, from_mps, cruise_mps, to_mps)
    first_m, last_m = turn_way(from_mps, cruise_mps, first, 1.0), turn_way(cruise_mps, to_mps, last, 1.0)
    turned = from_m[0] + first_m[0], from_m[1] + first_m[1]
    turning = to_m[0] - last_m[0], to_m[1] - last_m[1]
    brake_s = _apart(to_mps, (0.0, 0.0)) / legs.max_accel_mps2
    rest = to_m[0] + 0.5 * brake_s * to_mps[0], to_m[1] + 0.5 * brake_s * to_mps[1]
    for point in (turned, turning, to_m, rest):
        if not _inside(walls, point):
            return False
    if walls.box_m.shape[0] > 0 and (_meets(walls, turned, turning) or _meets(walls, to_m, rest)):
        return False
    return _turns_clear(walls, legs, from_m, from_mps, cruise_mps, first) and _turns_clear(
        walls, legs, turning, cruise_mps, to_mps, last
    )


@compiled
def _turns_clear(
    walls: Walls,
    legs: Legs,
    from_m: tuple[float, float],
    from_mps: tuple[float, float],
    to_mps: tuple[float, float],
    bend: tuple[float, float],
) -> bool:
    """A turn that begins and ends inside stays inside and clear of obstacles, by chords of it.

    Its velocity turns by half a circle at most: to east or north it goes back where its ends differ in direction,
    and elsewhere lies between its ends.
    """
    turns_east, turns_north = from_mps[0] * to_mps[0] < 0.0, from_mps[1] * to_mps[1] < 0.0
    if walls.box_m.shape[0] == 0:
        far_m = bend[1] * max(_apart(from_mps, (0.0, 0.0)), _apart(to_mps, (0.0, 0.0)))
        far_e, far_n = (far_m if turns_east else 0.0), (far_m if turns_north else 0.0)
        if _inside(walls, (from_m[0] - far_e, from_m[1] - far_n)) and _inside(
            walls, (from_m[0] + far_e, from_m[1] + far_n)
        ):
            return True
    chords = max(int(np.ceil(bend[1] / CHORD_S)), 1)
    beside_m = legs.max_accel_mps2 * (bend[1] / chords) ** 2 / 8.0
    beside_e, beside_n = (beside_m if turns_east else 0.0), (beside_m if turns_north else 0.0)
    before = from_m
    for chord in range(1, chords + 1):
        way = turn_way(from_mps, to_mps, bend, chord / chords)
        after = from_m[0] + way[0], from_m[1] + way[1]
        within = chord == chords or (
            _inside(walls, (after[0] - beside_e, after[1] - beside_n))
            and _inside(walls, (after[0] + beside_e, after[1] + beside_n))
        )
        if not within or _meets(walls, before, after):
            return False
        before = after
    return True


@compiled
def cruise(
    legs: Legs,
    from_m: tuple[float, float],
    from_mps: tuple[float, float],
    to_m: tuple[float, float],
    to_mps: tuple[float, float],
) -> tuple[float, float, bool]:
    """The velocity flown between the two turns of a leg, east and north, and whether there is one.

    By Newton's method, from the velocity that would do if velocities changed straight; a step is shortened until it
    comes nearer. It may find none where there is one: beside reversals, where a bend may be to the left or the right.
    """
    way = to_m[0] - from_m[0], to_m[1] - from_m[1]
    at = way[0] / legs.slot_s, way[1] / legs.slot_s
    if legs.max_accel_mps2 == np.inf:
        return at[0], at[1], at[0] * at[0] + at[1] * at[1] <= (legs.max_speed_mps * (1.0 + ROUNDING)) ** 2
    at = _no_faster(_straight_cruise(legs, from_mps, way, to_mps), legs.max_speed_mps)
    east, north, _, _ = _leg(legs, from_mps, at, to_mps)
    off_e, off_n = east - way[0], north - way[1]
    for _ in range(NEWTON_STEPS):
        if off_e * off_e + off_n * off_n < LEG_MISS_M * LEG_MISS_M:
            break
        east_e, east_n, _, _ = _leg(legs, from_mps, (at[0] + SLOPE_MPS, at[1]), to_mps)
        north_e, north_n, _, _ = _leg(legs, from_mps, (at[0], at[1] + SLOPE_MPS), to_mps)
        j_ee, j_ne = (east_e - way[0] - off_e) / SLOPE_MPS, (east_n - way[1] - off_n) / SLOPE_MPS
        j_en, j_nn = (north_e - way[0] - off_e) / SLOPE_MPS, (north_n - way[1] - off_n) / SLOPE_MPS
        det = j_ee * j_nn - j_en * j_ne
        if abs(det) < 1e-3:
            break
        d_e, d_n = (j_en * off_n - j_nn * off_e) / det, (j_ne * off_e - j_ee * off_n) / det
        share = min(1.0, MOST_STEP_MPS / np.sqrt(d_e * d_e + d_n * d_n))
        for _ in range(SHORTER_STEPS):
            then = _no_faster((at[0] + share * d_e, at[1] + share * d_n), FASTEST_SHARE * legs.max_speed_mps)
            east, north, _, _ = _leg(legs, from_mps, then, to_mps)
            then_e, then_n = east - way[0], north - way[1]
            if then_e * then_e + then_n * then_n < off_e * off_e + off_n * off_n:
                break
            share *= 0.4
        else:
            break
        at, off_e, off_n = then, then_e, then_n
    found = off_e * off_e + off_n * off_n < LEG_MISS_M * LEG_MISS_M
    found = found and at[0] * at[0] + at[1] * at[1] <= (legs.max_speed_mps * (1.0 + ROUNDING)) ** 2
    in_time = _apart(from_mps, at) + _apart(at, to_mps) <= legs.max_accel_mps2 * legs.slot_s
    return at[0], at[1], found and in_time


@compiled
def _straight_cruise(
    legs: Legs, from_mps: tuple[float, float], way_m: tuple[float, float], to_mps: tuple[float, float]
) -> tuple[float, float]:
    """Near to the root of tau u - |u - v0| (u - v0) / 2a - |u - v1| (u - v1) / 2a = way."""
    east, north, half = way_m[0] / legs.slot_s, way_m[1] / legs.slot_s, 0.5 / legs.max_accel_mps2
    for _ in range(STRAIGHT_STEPS):
        a_e, a_n, b_e, b_n = east - from_mps[0], north - from_mps[1], east - to_mps[0], north - to_mps[1]
        a, b = max(np.sqrt(a_e * a_e + a_n * a_n), 1e-9), max(np.sqrt(b_e * b_e + b_n * b_n), 1e-9)
        miss_e = legs.slot_s * east - half * (a * a_e + b * b_e) - way_m[0]
        miss_n = legs.slot_s * north - half * (a * a_n + b * b_n) - way_m[1]
        j_ee = legs.slot_s - half * (a + b + a_e * a_e / a + b_e * b_e / b)
        j_nn = legs.slot_s - half * (a + b + a_n * a_n / a + b_n * b_n / b)
        j_en = -half * (a_e * a_n / a + b_e * b_n / b)
        det = j_ee * j_nn - j_en * j_en
        if det < 1e-3:
            break
        east -= (j_nn * miss_e - j_en * miss_n) / det
        north -= (j_ee * miss_n - j_en * miss_e) / det
    return east, north


@compiled
def _no_faster(vel_mps: tuple[float, float], limit_mps: float) -> tuple[float, float]:
    share = min(1.0, limit_mps / max(_apart(vel_mps, (0.0, 0.0)), TINY))
    return share * vel_mps[0], share * vel_mps[1]


@compiled
def _inside(walls: Walls, at_m: tuple[float, float]) -> bool:
    is_inside: bool = walls.low_m[0] <= at_m[0] <= walls.high_m[0] and walls.low_m[1] <= at_m[1] <= walls.high_m[1]
    return is_inside


@compiled
def _meets(walls: Walls, from_m: tuple[float, float], to_m: tuple[float, float]) -> bool:
    """A straight way comes within the margin of an obstacle."""
    met = False
    for obstacle in range(walls.box_m.shape[0]):
        met = met or _blocked(walls, obstacle, from_m, to_m)
    return met


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
def _bounds(walls: Walls, path_m: FloatArray, depth: int, last: int) -> tuple[float, float, float, float]:
    """How far a block may be shifted inside the area: west, east, south, north."""
    east_0, east_1 = min(path_m[depth, 0], path_m[last, 0]), max(path_m[depth, 0], path_m[last, 0])
    north_0, north_1 = min(path_m[depth, 1], path_m[last, 1]), max(path_m[depth, 1], path_m[last, 1])
    return (walls.low_m[0] - east_0, walls.high_m[0] - east_1, walls.low_m[1] - north_0, walls.high_m[1] - north_1)


@compiled
def _in_play(users: Users, others_gap_m: Float32Array, path_m: FloatArray, depth: int, last: int, desk: Desk) -> int:
    """Users for whom it matters where these places are shifted, put first in ``desk.who``: how many there are. To the
    rest another UAV stays nearer anyway.
    """
    matters, who, count = desk.matters, desk.who, 0
    matters[:] = 0
    for slot in range(depth, last + 1):
        east, north = np.float32(path_m[slot, 0]), np.float32(path_m[slot, 1])
        for user in range(matters.size):
            d_east, d_north = users.east_m[slot, user] - east, users.north_m[slot, user] - north
            least = np.sqrt(d_east * d_east + d_north * d_north) - users.inner_m[slot, user] - SHIFT_M
            matters[user] |= np.int32(1) if others_gap_m[slot, user] > max(least, ZERO) else np.int32(0)
    for user in range(matters.size):
        who[count] = user
        count += matters[user]
    return count


@compiled
def _crowd(users: Users, slot: int, others_gap_m: Float32Array, desk: Desk, count: int, which: int) -> None:
    """Those in play; what their ages cost is left to be filled in."""
    crowds = desk.crowds
    for index in range(count):
        user = desk.who[index]
        crowds[which, EAST, index], crowds[which, NORTH, index] = users.east_m[slot, user], users.north_m[slot, user]
        crowds[which, INNER, index], crowds[which, FADE, index] = (
            users.inner_m[slot, user],
            users.fade_per_m[slot, user],
        )
        crowds[which, OTHERS, index] = others_gap_m[slot, user]


@compiled
def _take_slopes(users: Users, prices: Prices, own_gap_m: Float32Array, others_gap_m: Float32Array, desk: Desk) -> None:
    """What one slot of age of each user after slot t costs in slots after t: [H, N]; at the end, per metre."""
    slope = desk.slope
    horizon, count = slope.shape
    discount = np.float32(prices.discount**horizon)
    for user in range(count):
        slope[horizon - 1, user] = discount * np.float32(prices.end) * users.weight[user]
    for depth in range(horizon - 2, -1, -1):
        age_price = np.float32(desk.age_price[depth + 1])
        is_next_last = depth + 1 == horizon - 1
        for user in range(count):
            gap = min(own_gap_m[depth + 1, user], others_gap_m[depth + 1, user])
            miss = min(gap * users.fade_per_m[depth + 1, user], ONE)
            after = slope[depth + 1, user]
            if is_next_last:
                after *= gap if miss > ZERO else ZERO
            slope[depth, user] = miss * (age_price * users.weight[user] + after)


@compiled
def _price_one(desk: Desk, count: int, cover: np.float32, east_m: np.float32, north_m: np.float32) -> float:
    """What depends on one place; ``cover`` is lost for each user missed."""
    crowds, ages = desk.crowds, desk.age
    total = ZERO
    for user in range(count):
        d_east, d_north = crowds[THEN, EAST, user] - east_m, crowds[THEN, NORTH, user] - north_m
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - crowds[THEN, INNER, user], ZERO)
        gap = min(gap, crowds[THEN, OTHERS, user])
        miss = min(gap * crowds[THEN, FADE, user], ONE)
        later = crowds[THEN, PER_SLOT, user] + crowds[THEN, PER_SLOT_METRE, user] * gap
        total += (ONE + miss * ages[user]) * later + cover * miss
    return float(total)


@compiled
def _price_two(
    desk: Desk,
    count: int,
    cover: np.float32,
    place_m: tuple[np.float32, np.float32],
    next_m: tuple[np.float32, np.float32],
) -> float:
    """What depends on two places in a row."""
    crowds, ages = desk.crowds, desk.age
    total = ZERO
    e_0, n_0 = place_m
    e_1, n_1 = next_m
    for user in range(count):
        d_east, d_north = crowds[FIRST, EAST, user] - e_0, crowds[FIRST, NORTH, user] - n_0
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - crowds[FIRST, INNER, user], ZERO)
        miss = min(min(gap, crowds[FIRST, OTHERS, user]) * crowds[FIRST, FADE, user], ONE)
        age = ONE + miss * ages[user]
        d_east, d_north = crowds[THEN, EAST, user] - e_1, crowds[THEN, NORTH, user] - n_1
        gap = max(np.sqrt(d_east * d_east + d_north * d_north) - crowds[THEN, INNER, user], ZERO)
        gap = min(gap, crowds[THEN, OTHERS, user])
        miss_1 = min(gap * crowds[THEN, FADE, user], ONE)
        later = crowds[THEN, PER_SLOT, user] + crowds[THEN, PER_SLOT_METRE, user] * gap
        total += crowds[FIRST, PER_SLOT, user] * age + (ONE + miss_1 * age) * later + cover * (miss + miss_1)
    return float(total)


@compiled
def _cruise_j(cruise_j: FloatArray, step_m: float, way_m: float) -> float:
    """Energy of a slot at the steady speed that covers ``way_m``."""
    at = min(way_m / step_m, cruise_j.size - 1.0)
    low = min(int(at), cruise_j.size - 2)
    return float(cruise_j[low] + (at - low) * (cruise_j[low + 1] - cruise_j[low]))


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
