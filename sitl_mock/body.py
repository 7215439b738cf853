"""What one autopilot feels and moves: its row of the fleet's physics, its pad and its battery."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan, nan
from typing import TYPE_CHECKING

from sitl_mock.geodesy import Geodetic, to_geodetic
from sitl_mock.physics import layout

if TYPE_CHECKING:
    from sitl_mock.physics.fleet import Fleet
    from sitl_mock.physics.vehicle import VehicleType

Vec3 = tuple[float, float, float]

# Lithium polymer, volts a cell: full, nominal, empty under load (manufacturers' usual 4.2 / 3.7 / 3.3).
_CELL_FULL_V, _CELL_NOMINAL_V, _CELL_EMPTY_V = 4.2, 3.7, 3.3
_CELL_OHM = 0.004  # internal resistance, a fresh 4.5 Ah cell


@dataclass(frozen=True, slots=True)
class Battery:
    """What the power module measures."""

    voltage_v: float
    current_a: float
    used_mah: float
    remaining: float  # 1 full, 0 empty
    cells: int


class Body:
    """Vehicle `index` of a fleet. Positions are metres NED from its pad."""

    def __init__(self, fleet: Fleet, index: int, pad: Geodetic) -> None:
        """`pad`: where the vehicle stands at boot."""
        self._fleet, self.index, self.pad = fleet, index, pad
        self._column = fleet.column(index)
        self._command = fleet.command[index]
        self._drained_j = 0.0

    @property
    def kind(self) -> VehicleType:
        """Present limits."""
        return self._fleet.types[self.index]

    def set_limits(self, kind: VehicleType) -> None:
        """Changes the limits, e.g. after a parameter was set."""
        self._fleet.set_limits(self.index, kind)

    @property
    def pos_ned_m(self) -> Vec3:
        """Position from the pad."""
        north, east, down = self._column[layout.POS : layout.POS + 3].tolist()
        return north, east, down

    @property
    def vel_ned_mps(self) -> Vec3:
        """Velocity over ground."""
        north, east, down = self._column[layout.VEL : layout.VEL + 3].tolist()
        return north, east, down

    @property
    def down_m(self) -> float:
        """Height below the pad (negative in the air)."""
        return float(self._column[layout.POS + 2])

    @property
    def attitude_rad(self) -> Vec3:
        """Roll, pitch, yaw."""
        return self._fleet.attitude_rad(self.index)

    @property
    def yaw_rad(self) -> float:
        """Where the nose points, clockwise from north."""
        return float(self._column[layout.YAW])

    @property
    def on_ground(self) -> bool:
        """Whether the ground carries it."""
        return self.down_m >= -0.01 and float(self._column[layout.VEL_WISH + 2]) >= 0.0

    @property
    def place(self) -> Geodetic:
        """Where it is on the globe."""
        north, east, down = self.pos_ned_m
        return to_geodetic(self.pad, north, east, -down)

    @property
    def battery(self) -> Battery:
        """Energy by the world's model at nominal voltage; the terminal voltage falls with charge and load."""
        kind = self.kind
        used_j = float(self._column[layout.USED_J]) + self._drained_j
        remaining = max(0.0, 1.0 - used_j / kind.battery_j)
        cells = max(1, round(kind.battery_v / _CELL_NOMINAL_V))
        rest_v = cells * (_CELL_EMPTY_V + (_CELL_FULL_V - _CELL_EMPTY_V) * remaining)
        current_a = float(self._column[layout.POWER_W]) / kind.battery_v
        return Battery(
            rest_v - cells * _CELL_OHM * current_a,
            current_a,
            used_j / (3.6 * kind.battery_v),
            remaining,
            cells,
        )

    def drain(self, fraction: float) -> None:
        """Takes this part of the full battery away at once (a failing cell)."""
        self._drained_j += fraction * self.kind.battery_j

    def drive(self, vel_ned_mps: Vec3, yaw_rad: float | None, *, motors: bool) -> None:
        """Sets what the physics follows until the next call; `yaw_rad` None keeps the nose where it is."""
        command = self._command
        command[0], command[1], command[2] = vel_ned_mps
        command[layout.CMD_YAW] = nan if yaw_rad is None or isnan(yaw_rad) else yaw_rad
        command[layout.CMD_MOTORS] = 1.0 if motors else 0.0
