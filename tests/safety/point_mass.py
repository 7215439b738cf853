"""A body for the gate's tests, simple enough to be right at sight, and setpoints in short."""

from dataclasses import dataclass

import numpy as np

from gcs.ports import UavTrack, VelocitySetpoint

CLIMB_ACCEL_MPS2 = 1.0  # ArduPilot's WPNAV_ACCEL_Z; the envelope counts on no more


@dataclass
class PointMass:
    """A vehicle that takes up a commanded velocity after a dead time, at a limited acceleration."""

    east_m: float
    north_m: float
    alt_m: float
    vel: np.ndarray
    accel: float
    dead_ticks: int
    drift_mps: float = 0.0  # upward, of the air; the body does not hold its height by itself

    def __post_init__(self) -> None:
        self.queue = [self.vel.copy()] * self.dead_ticks

    def fly(self, command_enu: tuple[float, float, float], tick_s: float) -> None:
        self.queue.append(np.array(command_enu))
        change = self.queue.pop(0) - self.vel
        size = float(np.linalg.norm(change[:2]))
        if size > self.accel * tick_s:
            change[:2] *= self.accel * tick_s / size
        most = CLIMB_ACCEL_MPS2 * tick_s
        change[2] = min(most, max(-most, change[2]))
        self.vel = self.vel + change
        self.east_m += self.vel[0] * tick_s
        self.north_m += self.vel[1] * tick_s
        self.alt_m += (self.vel[2] + self.drift_mps) * tick_s

    def track(self, system_id: int) -> UavTrack:
        east, north, up = map(float, self.vel)
        return UavTrack(system_id, self.east_m, self.north_m, self.alt_m, east, north, up + self.drift_mps, 0.0, 0.0)


def setpoint(system_id: int = 1, north: float = 0.0, east: float = 0.0, down: float = 0.0) -> VelocitySetpoint:
    return VelocitySetpoint(system_id, (north, east, down), 0.0)
