"""What the autopilot believes about its place: receiver errors, delays and glitches, and a filter that doubts them."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import exp, hypot, sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

Vec3 = tuple[float, float, float]
_CORRELATION_S = 60.0  # a receiver's error wanders over a minute (atmosphere, multipath)
_VERTICAL = 1.5  # it is worse upwards
_GATE_M = 5.0  # EK3_GLITCH_RAD 25 m and innovation gates: smaller steps are followed at once
_DISTRUST_S = 7.0  # EKF2 and EKF3 reset to the receiver after rejecting it this long


@dataclass(frozen=True, slots=True)
class Receiver:
    """How good the GPS is."""

    noise_m: float = 0.0  # standard deviation, horizontal
    delay_s: float = 0.2  # of what it reports; the filter makes up for it (GPS_DELAY_MS, EKF2_GPS_DELAY: 0.1 to 0.2)


class Position:
    """The error of the position estimate, and the receiver's own report."""

    def __init__(self, receiver: Receiver, rng: np.random.Generator) -> None:
        """`rng` makes the noise."""
        self._receiver, self._rng = receiver, rng
        self._wander: list[float] = [0.0, 0.0, 0.0]
        self._history: deque[tuple[float, Vec3, Vec3]] = deque()
        self._accepted_m = 0.0  # the part of a glitch that the filter believes
        self._doubt_s: float | None = None
        self.offset_m = 0.0  # the receiver's glitch, north
        self.extra_noise_m = 0.0

    @property
    def doubting(self) -> bool:
        """Whether the filter rejects the receiver."""
        return self._doubt_s is not None

    @property
    def error_ned_m(self) -> Vec3:
        """Estimate less truth."""
        north, east, down = self._wander
        return north + self._accepted_m, east, down

    def advance(self, now_s: float, step_s: float, pos_ned_m: Vec3, vel_ned_mps: Vec3) -> None:
        """One step: `pos_ned_m`, `vel_ned_mps` are the truth."""
        noise_m = self._receiver.noise_m + self.extra_noise_m
        if noise_m > 0.0 or any(self._wander):
            keep = exp(-step_s / _CORRELATION_S)
            fresh = noise_m * sqrt(1.0 - keep * keep)
            for axis, scale in enumerate((1.0, 1.0, _VERTICAL)):
                self._wander[axis] = keep * self._wander[axis] + fresh * scale * float(self._rng.standard_normal())
        self._doubt(now_s)
        north, east, down = pos_ned_m
        wander = self._wander
        seen = (north + wander[0] + self.offset_m, east + wander[1], down + wander[2])
        self._history.append((now_s, seen, vel_ned_mps))
        while len(self._history) > 1 and self._history[1][0] <= now_s - self._receiver.delay_s + 1e-9:
            self._history.popleft()

    def _doubt(self, now_s: float) -> None:
        """A jump of the receiver is rejected for a while, then believed."""
        if abs(self.offset_m - self._accepted_m) <= _GATE_M:
            self._accepted_m, self._doubt_s = self.offset_m, None
        elif self._doubt_s is None:
            self._doubt_s = now_s
        elif now_s - self._doubt_s >= _DISTRUST_S:
            self._accepted_m, self._doubt_s = self.offset_m, None

    @property
    def report(self) -> tuple[Vec3, Vec3]:
        """The receiver's place and velocity, as late as they come."""
        _, place, velocity = self._history[0] if self._history else (0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        return place, velocity

    @property
    def accuracy_m(self) -> float:
        """What the receiver says of itself: it does not know of its glitches."""
        return 0.5 + hypot(self._receiver.noise_m, self.extra_noise_m)
