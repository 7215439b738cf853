"""The path of one slot that guidance follows: the world's own motion from the slot's start to its end point."""

from dataclasses import dataclass

import numpy as np

from policy.world.arrays import FloatArray
from policy.world.motion import slot_motion, slot_times_s

REFERENCE_STEP_S = 0.1  # one sample a tick; between samples it is linear


@dataclass(frozen=True)
class Point:
    """Place and velocity of the reference, east and north."""

    east_m: float
    north_m: float
    vel_east_mps: float
    vel_north_mps: float


@dataclass(frozen=True)
class SlotReference:
    """One UAV's slot, sampled evenly. After its end the last velocity goes on: a slot never ends at rest."""

    start_s: float
    step_s: float
    points: tuple[Point, ...]

    def at(self, now_s: float) -> Point:
        """The reference at ``now_s``; before the start it is the start."""
        place = (now_s - self.start_s) / self.step_s
        last = len(self.points) - 1
        if place >= last:
            return _onward(self.points[last], (place - last) * self.step_s)
        if place <= 0.0:
            return self.points[0]
        low = int(place)
        return _between(self.points[low], self.points[low + 1], place - low)

    def delayed(self, delay_s: float) -> "SlotReference":
        """The same path flown later, after a pause."""
        return SlotReference(self.start_s + delay_s, self.step_s, self.points)

    def outline(self, count: int = 6) -> tuple[tuple[float, float], ...]:
        """A few points from start to end, for the map."""
        picks = np.linspace(0, len(self.points) - 1, count).round().astype(int)
        return tuple((self.points[i].east_m, self.points[i].north_m) for i in picks)


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
    samples = max(2, round(slot_s / REFERENCE_STEP_S) + 1)
    times_s = slot_times_s(pos_m, slot_s, samples)
    start, goal = vel_mps[:, None, :], vel_command_mps[:, None, :]
    end = None if vel_end_mps is None else vel_end_mps[:, None, :]
    way_m, velocities_mps = slot_motion(start, goal, end, max_accel_mps2, slot_s, times_s)
    rows = np.concatenate((pos_m[:, None, :] + way_m, velocities_mps), axis=-1).tolist()
    step_s = slot_s / (samples - 1)
    return tuple(SlotReference(start_s, step_s, tuple(Point(*row) for row in uav)) for uav in rows)


def _between(low: Point, high: Point, share: float) -> Point:
    rest = 1.0 - share
    return Point(
        rest * low.east_m + share * high.east_m,
        rest * low.north_m + share * high.north_m,
        rest * low.vel_east_mps + share * high.vel_east_mps,
        rest * low.vel_north_mps + share * high.vel_north_mps,
    )


def _onward(end: Point, after_s: float) -> Point:
    return Point(
        end.east_m + end.vel_east_mps * after_s,
        end.north_m + end.vel_north_mps * after_s,
        end.vel_east_mps,
        end.vel_north_mps,
    )
