"""The battery pack: energy by the world's model, terminal voltage by charge, load and temperature.

Energy counts at nominal voltage, as the paper does; the voltage is what a power module would show beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sitl_mock.physics.vehicle import VehicleType

# Lithium polymer at rest, volts a cell by charge left: the usual discharge curve (4.2 full, 3.7 nominal, 3.3 empty).
_CHARGE = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
_REST_V = (3.30, 3.45, 3.55, 3.65, 3.70, 3.74, 3.78, 3.82, 3.88, 3.95, 4.05, 4.20)
_NOMINAL_V = 3.7
_CELL_OHM = 0.004  # internal resistance at 25 deg C, a fresh 4.5 Ah cell
_COLDER = 0.028  # 1/K: resistance doubles towards freezing (Arrhenius, manufacturers' cold-discharge curves)
_SLOW_OHM, _SLOW_S = 0.003, 30.0  # the slow part of the sag: diffusion
_HEAT_J_K, _COOLING_W_K = 100.0, 0.15  # a cell: about 0.1 kg at 1000 J/(kg K), still air
_FAILED_V = 2.0  # what a collapsed cell still shows


@dataclass(frozen=True, slots=True)
class Battery:
    """What the power module measures."""

    voltage_v: float
    current_a: float
    used_mah: float
    remaining: float  # 1 full, 0 empty
    cell_v: tuple[float, ...]
    temperature_c: float

    @property
    def cells(self) -> int:
        """How many in series."""
        return len(self.cell_v)


class Pack:
    """One vehicle's battery."""

    def __init__(self, kind: VehicleType, ambient_c: float) -> None:
        """Full, as warm as the air."""
        self._energy_j, self._nominal_v = kind.battery_j, kind.battery_v
        self.cells = max(1, round(kind.battery_v / _NOMINAL_V))
        self._ambient_c = self.temperature_c = ambient_c
        self._slow_v = 0.0  # a cell
        self._drained_j = 0.0
        self.failed_cells = 0

    def _cell_ohm(self) -> float:
        return _CELL_OHM * exp(_COLDER * (25.0 - self.temperature_c))

    def advance(self, power_w: float, step_s: float) -> None:
        """Warms up under load, and sags on."""
        current_a = power_w / self._nominal_v
        heat_w = current_a * current_a * (self._cell_ohm() + _SLOW_OHM)
        cooling_w = _COOLING_W_K * (self.temperature_c - self._ambient_c)
        self.temperature_c += (heat_w - cooling_w) / _HEAT_J_K * step_s
        self._slow_v += (current_a * _SLOW_OHM - self._slow_v) * step_s / _SLOW_S

    def drain(self, fraction: float) -> None:
        """Takes this part of the full charge away at once."""
        self._drained_j += fraction * self._energy_j

    def remaining(self, used_j: float) -> float:
        """Charge left, 1 to 0, when the vehicle has used so much."""
        return max(0.0, 1.0 - (used_j + self._drained_j) / self._energy_j)

    def measure(self, used_j: float, power_w: float) -> Battery:
        """What the power module shows."""
        remaining, current_a = self.remaining(used_j), power_w / self._nominal_v
        rest_v = float(np.interp(remaining, _CHARGE, _REST_V))
        good_v = max(rest_v - current_a * self._cell_ohm() - self._slow_v, 0.0)
        failed = min(self.failed_cells, self.cells)
        cell_v = (good_v,) * (self.cells - failed) + (min(good_v, _FAILED_V),) * failed
        used_mah = (used_j + self._drained_j) / (3.6 * self._nominal_v)
        return Battery(sum(cell_v), current_a, used_mah, remaining, cell_v, self.temperature_c)
