"""N vehicles in the air: the state arrays, the wind and the energy table around the compiled kernel."""

from __future__ import annotations

from math import atan, atan2, cos, hypot, radians, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from policy.world.energy import propulsion_power_w
from sitl_mock.physics import kernel
from sitl_mock.physics.vehicle import GRAVITY_MPS2, VehicleType, parameter_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

Array = NDArray[np.float64]

TICK_S = 0.02  # the physics step: a tenth of the fastest response (lean, 0.16 s), and 50 Hz telemetry
_POWER_STEP_MPS = 0.05
_POWER_TOP_MPS = 80.0  # a free fall's airspeed stays under it
_POWER_TABLE_W: Array = np.asarray(propulsion_power_w(np.arange(0.0, _POWER_TOP_MPS, _POWER_STEP_MPS)))


class Fleet:
    """Motion of N vehicles. Positions are NED metres from each vehicle's own pad, velocities over ground."""

    def __init__(self, types: Sequence[VehicleType], wind_ne_mps: Array | None = None) -> None:
        """`wind_ne_mps`: where the air moves to, [2] for all or [N, 2]; calm if omitted."""
        count = len(types)
        self.types = tuple(types)
        self._kinds = parameter_rows(list(types))
        self._state: Array = np.zeros((count, kernel.STATE_WIDTH))
        self.command: Array = np.zeros((count, kernel.COMMAND_WIDTH))
        self.command[:, kernel.CMD_YAW] = np.nan
        self.wind_ne_mps: Array = np.zeros((count, 2))
        if wind_ne_mps is not None:
            self.wind_ne_mps[:] = wind_ne_mps

    def __len__(self) -> int:
        return len(self.types)

    @property
    def pos_ned_m(self) -> Array:
        """[N, 3] view: north, east, down from the pad."""
        return self._state[:, kernel.POS : kernel.POS + 3]

    @property
    def vel_ned_mps(self) -> Array:
        """[N, 3] view: velocity over ground."""
        return self._state[:, kernel.VEL : kernel.VEL + 3]

    @property
    def used_j(self) -> Array:
        """[N] view: energy taken from the battery so far."""
        return self._state[:, kernel.USED_J]

    @property
    def power_w(self) -> Array:
        """[N] view: present propulsion power."""
        return self._state[:, kernel.POWER_W]

    @property
    def yaw_rad(self) -> Array:
        """[N] view: where the nose points, clockwise from north."""
        return self._state[:, kernel.YAW]

    def row(self, i: int) -> Array:
        """Vehicle `i`'s state, a view in the kernel's columns."""
        row: Array = self._state[i]
        return row

    def attitude_rad(self, i: int) -> tuple[float, float, float]:
        """Roll, pitch, yaw of vehicle `i`: the lean that gives its horizontal acceleration."""
        row = self._state[i]
        north, east, yaw = float(row[kernel.LEAN]), float(row[kernel.LEAN + 1]), float(row[kernel.YAW])
        forward = north * cos(yaw) + east * sin(yaw)
        right = east * cos(yaw) - north * sin(yaw)
        return atan(right / GRAVITY_MPS2), -atan(forward / GRAVITY_MPS2), yaw

    def set_limits(self, i: int, kind: VehicleType) -> None:
        """Changes what vehicle `i` can do, e.g. after a parameter was set."""
        self.types = (*self.types[:i], kind, *self.types[i + 1 :])
        self._kinds[i] = parameter_rows([kind])[0]

    def advance(self, ticks: int) -> None:
        """Moves all vehicles on by `ticks` steps of TICK_S under the present commands."""
        kernel.advance(
            self._state,
            self.command,
            self._kinds,
            self.wind_ne_mps,
            _POWER_TABLE_W,
            _POWER_STEP_MPS,
            TICK_S,
            ticks,
        )

    def place(self, pos_ned_m: Array, vel_ned_mps: Array) -> None:
        """Puts all vehicles at [N, 3] with velocities [N, 3], flying steadily, with full batteries."""
        self._state[:] = 0.0
        self.pos_ned_m[:] = pos_ned_m
        self.vel_ned_mps[:] = vel_ned_mps
        self._state[:, kernel.VEL_WISH : kernel.VEL_WISH + 3] = vel_ned_mps


def wind_ne(speed_mps: float, from_deg: float) -> tuple[float, float]:
    """Meteorological wind (where it comes from) to the air's velocity north, east."""
    return -speed_mps * cos(radians(from_deg)), -speed_mps * sin(radians(from_deg))


def course_rad(vel_ne: Sequence[float]) -> float:
    """Direction of travel clockwise from north, in [0, 2 pi); 0 at rest."""
    north, east = vel_ne
    return atan2(east, north) % (2 * np.pi) if hypot(north, east) > 1e-3 else 0.0
