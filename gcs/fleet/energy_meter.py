"""Energy that the flown speeds cost by the world's model (Section III)."""

import numpy as np

from policy.world.arrays import FloatArray
from policy.world.energy import propulsion_power_w


class EnergyMeter:
    """Collects ground speeds tick by tick and integrates them when asked (trapezoid over the true tick times)."""

    def __init__(self, num_uavs: int, used_j: FloatArray | None = None) -> None:
        """``used_j`` [U]: what a flight that is taken up again has used before."""
        self._used_j = np.zeros(num_uavs) if used_j is None else np.array(used_j, dtype=np.float64)
        self._times_s: list[float] = []
        self._speeds_mps: list[list[float]] = []
        self._airborne: list[list[bool]] = []

    def tick(self, now_s: float, speed_mps: list[float], airborne: list[bool]) -> None:
        """Speeds [U] at ``now_s``; a UAV that is not in the air spends nothing."""
        self._times_s.append(now_s)
        self._speeds_mps.append(speed_mps)
        self._airborne.append(airborne)

    def assume_hover(self, duration_s: float, airborne: list[bool]) -> None:
        """Nobody watched for so long: a vehicle that is in the air now hovered, for all that is known."""
        hover_w = float(propulsion_power_w(np.array(0.0)))
        self._used_j = self._used_j + hover_w * duration_s * np.asarray(airborne, dtype=np.float64)

    def used_j(self) -> FloatArray:
        """[U] joules since construction."""
        if len(self._times_s) > 1:
            times_s = np.asarray(self._times_s)
            power_w = propulsion_power_w(np.asarray(self._speeds_mps)) * np.asarray(self._airborne)
            mean_w = 0.5 * (power_w[1:] + power_w[:-1])
            self._used_j = self._used_j + np.sum(mean_w * np.diff(times_s)[:, None], axis=0)
            del self._times_s[:-1], self._speeds_mps[:-1], self._airborne[:-1]
        return np.array(self._used_j)
