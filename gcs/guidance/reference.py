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


@dataclass(frozen=True, eq=False)
class SlotReference:
    """One UAV's slot, sampled evenly. After its end the last velocity goes on: a slot never ends at rest.

    ``samples`` [K, 4]: a :class:`Point`'s fields. As an array, because most are looked at once or never: objects for
    all of a hundred UAVs' took half a tick at the beginning of a slot.
    """

    start_s: float
    step_s: float
    samples: FloatArray

    def at(self, now_s: float) -> Point:
        """The reference at ``now_s``; before the start it is the start."""
        last = len(self.samples) - 1
        place = min(max((now_s - self.start_s) / self.step_s, 0.0), float(last))
        low = min(int(place), last - 1)
        before, after = self.samples[low : low + 2].tolist()
        point = _between(before, after, place - low)
        beyond_s = now_s - (self.start_s + last * self.step_s)
        return point if beyond_s <= 0.0 else _onward(point, beyond_s)

    def delayed(self, delay_s: float) -> "SlotReference":
        """The same path flown later, after a pause."""
        return SlotReference(self.start_s + delay_s, self.step_s, self.samples)

    def outline(self, count: int = 6) -> tuple[tuple[float, float], ...]:
        """A few points from start to end, for the map."""
        picks = np.linspace(0, len(self.samples) - 1, count).round().astype(int)
        return tuple((east_m, north_m) for east_m, north_m in self.samples[picks, :2].tolist())


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
    points = np.concatenate((pos_m[:, None, :] + way_m, velocities_mps), axis=-1)
    points.flags.writeable = False
    return tuple(SlotReference(start_s, slot_s / (samples - 1), uav) for uav in points)


def _between(low: list[float], high: list[float], share: float) -> Point:
    rest = 1.0 - share
    return Point(*(rest * before + share * after for before, after in zip(low, high, strict=True)))


def _onward(end: Point, after_s: float) -> Point:
    return Point(
        end.east_m + end.vel_east_mps * after_s,
        end.north_m + end.vel_north_mps * after_s,
        end.vel_east_mps,
        end.vel_north_mps,
    )
