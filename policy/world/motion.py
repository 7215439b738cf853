"""How a UAV moves within a slot: it turns into the commanded velocity at limited acceleration, then flies steadily.

With an infinite limit this is the paper's motion, v tau in any direction. Otherwise the velocity changes along a
circular arc in the plane of velocities, at ``max_accel_mps2`` all the way. Between equal speeds the arc keeps the
speed: that is the coordinated turn of a flight dynamics book, and it leaves a right angle at 18 m/s and 4.5 m/s^2
10 m nearer to the corner than braking and speeding up in one straight change of velocity would. A straight change
is what remains of the arc where there is nothing to turn about: to and from rest, and in a reversal. No arc is ever
faster than the faster of its ends, and none takes longer than the slot leaves it.

A slot may also end on the way into the next one (*pre-turn*): then a second change of velocity begins as late as it
can and is complete when the slot ends.
"""

import math
from typing import NamedTuple

from policy.world.arrays import Array, array_namespace, norm

SAMPLES_PER_SLOT = 31
"""Points of a slot's path, ends included: 0.5 s apart in a slot of 15 s."""
REVERSAL_RAD = math.radians(15.0)
"""Nearer than this to a reversal arcs flatten, to the straight line that a reversal is."""
SLOW_SHARE = 0.5
"""Arcs flatten as well where one speed is less than this share of the other."""
STRAIGHT_RAD = 1e-8
"""Half of the least bend that is told from none: no turn leaves its straight line by a micrometre."""
TINY = 1e-12


class Turn(NamedTuple):
    """A change of velocity, [...] of them. With d the change and x half of the angle that its arc bends by, the
    velocity after a share s of its time is v + d exp(-i x (1 - s)) sin(x s) / sin x (east + i north).
    """

    vel_from_mps: Array  # [..., 2]
    change_mps: Array  # [..., 2]
    half_rad: Array  # [...] positive: counterclockwise; never 0, see STRAIGHT_RAD
    time_s: Array  # [...]


class SlotTurns(NamedTuple):
    """What a slot's motion is made of."""

    first: Turn  # into the velocity commanded
    last: Turn | None  # out of it, into the velocity at the slot's end
    begin_s: Array | None  # [...] of the last one


def change_time_s(vel_from_mps: Array, vel_to_mps: Array, max_accel_mps2: float) -> Array:
    """The least time, straight, until the new velocity is reached: [..., 2], [..., 2] -> [...]; 0 at no limit."""
    return norm(vel_to_mps - vel_from_mps) / max_accel_mps2


def make_turn(vel_from_mps: Array, vel_to_mps: Array, max_accel_mps2: float, most_s: Array | float) -> Turn:
    """Velocities [..., 2] at a finite limit; an arc that would take longer than ``most_s`` [...] is flattened until it
    does not, or is straight.
    """
    xp = array_namespace(vel_from_mps, vel_to_mps)
    vel_from_mps, vel_to_mps = xp.broadcast_arrays(vel_from_mps, vel_to_mps)
    change_mps = vel_to_mps - vel_from_mps
    straight_s = norm(change_mps) / max_accel_mps2
    from_e, from_n, to_e, to_n = (*_parts(vel_from_mps), *_parts(vel_to_mps))
    angle_rad = xp.atan2(from_e * to_n - from_n * to_e, from_e * to_e + from_n * to_n)
    speeds = norm(vel_from_mps), norm(vel_to_mps)
    slow, fast = xp.minimum(*speeds), xp.maximum(*speeds)
    bend = xp.clip((math.pi - xp.abs(angle_rad)) / REVERSAL_RAD, 0.0, 1.0)
    bend = bend * xp.clip(slow / (SLOW_SHARE * fast + TINY), 0.0, 1.0)
    half_rad = _bent(0.5 * angle_rad * bend)
    longer_s = straight_s * (half_rad / xp.sin(half_rad)) - straight_s
    # x / sin x is convex: flattened by this share, an arc takes no more than what is left.
    half_rad = _bent(half_rad * xp.clip((most_s - straight_s) / (longer_s + TINY), 0.0, 1.0))
    return Turn(vel_from_mps, change_mps, half_rad, straight_s * (half_rad / xp.sin(half_rad)))


def turn_motion(turn: Turn, time_s: Array) -> tuple[Array, Array]:
    """Way [..., 2] and velocity [..., 2] after ``time_s`` [...]: the turn, then steady flight."""
    xp = array_namespace(turn.change_mps)
    half_rad, total_s, time_s = xp.broadcast_arrays(turn.half_rad, turn.time_s, time_s)
    turning_s = xp.minimum(time_s, total_s)
    share = xp.where(total_s > 0.0, turning_s / (total_s + (total_s <= 0.0)), xp.ones_like(total_s))
    bent, left = half_rad * share, half_rad * (1.0 - share)
    sin = xp.sin(half_rad)
    reached = xp.sin(bent) / sin
    vel_mps = turn.vel_from_mps + _turned(turn.change_mps, reached * xp.cos(left), -reached * xp.sin(left))
    # The integral of reached exp(-i left) over the share: exp(-i x) / (2 i sin x) ((exp(2 i x s) - 1) / (2 i x) - s)
    along, across = _less_than_straight(half_rad, share), xp.sin(bent) ** 2 / half_rad
    cos = xp.cos(half_rad)
    mean_along = (cos * across - sin * along) / (2.0 * sin)
    mean_across = -(cos * along + sin * across) / (2.0 * sin)
    way_m = turn.vel_from_mps * turning_s[..., None] + _turned(
        turn.change_mps, total_s * mean_along, total_s * mean_across
    )
    return way_m + (turn.vel_from_mps + turn.change_mps) * (time_s - turning_s)[..., None], vel_mps


def slot_times_s(like: Array, slot_s: float, samples: int = SAMPLES_PER_SLOT) -> Array:
    """Evenly spaced times of a slot [samples], in the library, type and device of ``like``."""
    xp = array_namespace(like)
    return xp.arange(samples, dtype=like.dtype, device=like.device) * (slot_s / (samples - 1))


def slot_motion(
    vel_from_mps: Array,
    vel_to_mps: Array,
    vel_end_mps: Array | None,
    max_accel_mps2: float,
    slot_s: float,
    time_s: Array,
) -> tuple[Array, Array]:
    """Way [..., 2] and velocity [..., 2] after ``time_s`` [...] of a slot that ends at ``vel_end_mps``.

    None: the slot ends at the velocity commanded. The turn into ``vel_end_mps`` begins as late as it can, but not
    before ``vel_to_mps`` is reached: what is too much for one slot is not complete when it ends. The first turn has the
    time that a straight change into ``vel_end_mps`` leaves, the last one what the first has left.
    """
    if math.isinf(max_accel_mps2):  # as slot_state has it, for a tenth of the time: training flies little else
        way_m = vel_to_mps * time_s[..., None] + 0.0 * vel_from_mps
        return way_m, array_namespace(vel_to_mps, way_m).broadcast_arrays(vel_to_mps, way_m)[0]
    return slot_state(slot_turns(vel_from_mps, vel_to_mps, vel_end_mps, max_accel_mps2, slot_s), time_s)


def slot_turns(
    vel_from_mps: Array, vel_to_mps: Array, vel_end_mps: Array | None, max_accel_mps2: float, slot_s: float
) -> SlotTurns:
    """The turns of :func:`slot_motion`, for who asks for many moments of one slot."""
    xp = array_namespace(vel_from_mps, vel_to_mps)
    if math.isinf(max_accel_mps2):
        vel_mps = xp.broadcast_arrays(vel_to_mps, vel_from_mps)[0]
        at_once = Turn(vel_mps, xp.zeros_like(vel_mps), _bent(0.0 * vel_mps[..., 0]), 0.0 * vel_mps[..., 0])
        return SlotTurns(at_once, None, None)
    if vel_end_mps is None:
        return SlotTurns(make_turn(vel_from_mps, vel_to_mps, max_accel_mps2, slot_s), None, None)
    last_s = change_time_s(vel_to_mps, vel_end_mps, max_accel_mps2)
    first = make_turn(vel_from_mps, vel_to_mps, max_accel_mps2, slot_s - last_s)
    last = make_turn(vel_to_mps, vel_end_mps, max_accel_mps2, slot_s - first.time_s)
    return SlotTurns(first, last, xp.maximum(slot_s - last.time_s, first.time_s))


def slot_state(turns: SlotTurns, time_s: Array) -> tuple[Array, Array]:
    """Way [..., 2] and velocity [..., 2] after ``time_s`` [...] of a slot."""
    if turns.last is None:
        return turn_motion(turns.first, time_s)
    xp = array_namespace(turns.begin_s)
    begin_s, time_s = xp.broadcast_arrays(turns.begin_s, time_s)
    way_m, vel_mps = turn_motion(turns.first, xp.minimum(time_s, begin_s))
    turned_m, turned_mps = turn_motion(turns.last, xp.maximum(time_s - begin_s, xp.zeros_like(begin_s)))
    return way_m + turned_m, xp.where((time_s > begin_s)[..., None], turned_mps, vel_mps)


def slot_path_m(
    pos_m: Array,
    vel_from_mps: Array,
    vel_to_mps: Array,
    max_accel_mps2: float,
    slot_s: float,
    vel_end_mps: Array | None = None,
) -> tuple[Array, Array]:
    """Path and speed through a slot: [..., 2] each -> positions [..., K, 2] and speeds [..., K]."""
    times_s = slot_times_s(pos_m, slot_s)
    start, goal = vel_from_mps[..., None, :], vel_to_mps[..., None, :]
    end = None if vel_end_mps is None else vel_end_mps[..., None, :]
    way_m, vel_mps = slot_motion(start, goal, end, max_accel_mps2, slot_s, times_s)
    return pos_m[..., None, :] + way_m, norm(vel_mps)


def end_velocity_mps(
    vel_from_mps: Array, vel_to_mps: Array, max_accel_mps2: float, slot_s: float, vel_end_mps: Array | None = None
) -> Array:
    """Velocity at the slot's end: [..., 2] each -> [..., 2]."""
    last_s = slot_times_s(vel_to_mps, slot_s)[-1]
    return slot_motion(vel_from_mps, vel_to_mps, vel_end_mps, max_accel_mps2, slot_s, last_s)[1]


def stopping_point_m(pos_m: Array, vel_mps: Array, max_accel_mps2: float, reaction_s: float = 0.0) -> Array:
    """Where full braking after ``reaction_s`` comes to rest: [..., 2], [..., 2] -> [..., 2]."""
    way_s = reaction_s + norm(vel_mps) / (2.0 * max_accel_mps2)
    return pos_m + vel_mps * way_s[..., None]


def _parts(vector: Array) -> tuple[Array, Array]:
    return vector[..., 0], vector[..., 1]


def _bent(half_rad: Array) -> Array:
    """Kept from 0, where a bend's formulas have no value."""
    xp = array_namespace(half_rad)
    return xp.where(xp.abs(half_rad) < STRAIGHT_RAD, xp.full_like(half_rad, STRAIGHT_RAD), half_rad)


def _less_than_straight(half_rad: Array, share: Array) -> Array:
    """sin(2 x s) / (2 x) - s; by its series where the difference of near numbers would be lost in single precision."""
    xp = array_namespace(half_rad)
    series = -(2.0 / 3.0) * half_rad**2 * share**3
    return xp.where(xp.abs(half_rad) < 1e-2, series, xp.sin(2.0 * half_rad * share) / (2.0 * half_rad) - share)


def _turned(vector: Array, along: Array, across: Array) -> Array:
    """[..., 2] times the complex number of parts ``along`` and ``across`` [...]."""
    east, north = _parts(vector)
    return array_namespace(vector).stack((along * east - across * north, along * north + across * east), axis=-1)
