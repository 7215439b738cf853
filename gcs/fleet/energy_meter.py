"""Energy that the flown speeds cost by the world's model (Section III)."""

import numpy as np

from policy.world.arrays import FloatArray
from policy.world.energy import propulsion_power_w


class EnergyMeter:
    """Integrates ground speeds tick by tick (trapezoid over the true tick times).

    At each tick, not once a slot: the tick at which a slot ends has enough to do.
    """

    def __init__(self, num_uavs: int, used_j: FloatArray | None = None) -> None:
        """``used_j`` [U]: what a flight that is taken up again has used before."""
        self._used_j = np.zeros(num_uavs) if used_j is None else np.array(used_j, dtype=np.float64)
        self._newest: tuple[float, FloatArray] | None = None  # time, power [U]
        self._since_j: FloatArray | None = None  # [U] since :meth:`used_j` was asked last

    def tick(self, now_s: float, speed_mps: list[float], airborne: list[bool]) -> None:
        """Speeds [U] at ``now_s``; a UAV that is not in the air spends nothing."""
        power_w: FloatArray = propulsion_power_w(np.array(speed_mps, dtype=np.float64)) * np.array(airborne)
        if self._newest is not None:
            before_s, before_w = self._newest
            spent_j = 0.5 * (power_w + before_w) * (now_s - before_s)
            self._since_j = spent_j if self._since_j is None else self._since_j + spent_j
        self._newest = (now_s, power_w)

    def assume_hover(self, duration_s: float, airborne: list[bool]) -> None:
        """Nobody watched for so long: a vehicle that is in the air now hovered, for all that is known."""
        hover_w = float(propulsion_power_w(np.array(0.0)))
        self._used_j = self._used_j + hover_w * duration_s * np.asarray(airborne, dtype=np.float64)

    def used_j(self) -> FloatArray:
        """[U] joules since construction."""
        if self._since_j is not None:
            self._used_j, self._since_j = self._used_j + self._since_j, None
        return np.array(self._used_j)
