"""The path of one slot that guidance follows: the world's own motion from the slot's start to its end point."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from policy.world.arrays import FloatArray
from policy.world.motion import SlotTurns, slot_state, slot_turns

_KEPT = 8
"""Moments of a fleet's motion: those of a tick, or of the outlines that are drawn when a slot begins."""


@dataclass(frozen=True)
class Point:
    """Place and velocity of the reference, east and north."""

    east_m: float
    north_m: float
    vel_east_mps: float
    vel_north_mps: float


@dataclass(frozen=True, eq=False)
class FleetMotion:
    """U UAVs' slot, worked out for the moments that are asked for, all UAVs at once.

    Places [U, 2], velocities at the start, commanded, and (or None) at the end [U, 2]. A slot sampled as a whole took
    half a tick where it began, since NumPy lets go of the interpreter for more than 500 numbers; these are fewer.
    """

    pos_m: FloatArray
    vel_mps: FloatArray
    vel_command_mps: FloatArray
    vel_end_mps: FloatArray | None
    max_accel_mps2: float
    slot_s: float
    _known: dict[float, list[list[float]]] = field(default_factory=dict)

    @cached_property
    def _turns(self) -> SlotTurns:
        return slot_turns(self.vel_mps, self.vel_command_mps, self.vel_end_mps, self.max_accel_mps2, self.slot_s)

    def after(self, time_s: float) -> list[list[float]]:
        """[U][4]: a :class:`Point`'s fields so long after the start; within the slot."""
        rows = self._known.get(time_s)
        if rows is None:
            way_m, vel_mps = slot_state(self._turns, np.array(time_s))
            rows = np.concatenate((self.pos_m + way_m, vel_mps), axis=-1).tolist()
            if len(self._known) >= _KEPT:
                del self._known[next(iter(self._known))]
            self._known[time_s] = rows
        return rows


@dataclass(frozen=True, eq=False)
class SlotReference:
    """One UAV's slot. After its end the last velocity goes on: a slot never ends at rest."""

    motion: FleetMotion
    index: int
    start_s: float

    def at(self, now_s: float) -> Point:
        """The reference at ``now_s``; before the start it is the start."""
        since_s, slot_s = now_s - self.start_s, self.motion.slot_s
        point = Point(*self.motion.after(min(max(since_s, 0.0), slot_s))[self.index])
        return point if since_s <= slot_s else _onward(point, since_s - slot_s)

    def delayed(self, delay_s: float) -> "SlotReference":
        """The same path flown later, after a pause."""
        return SlotReference(self.motion, self.index, self.start_s + delay_s)

    def outline(self, count: int = 6) -> tuple[tuple[float, float], ...]:
        """A few points from start to end, for the map."""
        times_s = [self.motion.slot_s * number / (count - 1) for number in range(count)]
        points = [self.motion.after(time_s)[self.index] for time_s in times_s]
        return tuple((east_m, north_m) for east_m, north_m, _, _ in points)


def slot_references(
    pos_m: FloatArray,
    vel_mps: FloatArray,
    vel_command_mps: FloatArray,
    *,
    max_accel_mps2: float,
    slot_s: float,
    start_s: float,
    vel_end_mps: FloatArray | None = None,
) -> tuple[SlotReference, ...]:
    """References of U UAVs: places [U, 2], present and commanded velocities [U, 2] -> U.

    ``vel_end_mps`` [U, 2]: at which the slot is left, by a turn or braking that begins before it ends.
    """
    end_mps = None if vel_end_mps is None else _own(vel_end_mps)
    motion = FleetMotion(_own(pos_m), _own(vel_mps), _own(vel_command_mps), end_mps, max_accel_mps2, slot_s)
    return tuple(SlotReference(motion, index, start_s) for index in range(len(pos_m)))


def _own(values: FloatArray) -> FloatArray:
    """Whoever made them may use them again before they are asked for."""
    return np.array(values, dtype=np.float64)


def _onward(end: Point, after_s: float) -> Point:
    return Point(
        end.east_m + end.vel_east_mps * after_s,
        end.north_m + end.vel_north_mps * after_s,
        end.vel_east_mps,
        end.vel_north_mps,
    )
