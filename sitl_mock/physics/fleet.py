"""N vehicles in the air: the state arrays, the wind and the energy table around the compiled kernel."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan, atan2, cos, hypot, radians, sin
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from policy.world.energy import propulsion_power_w
from sitl_mock.physics import kernel, layout
from sitl_mock.physics.vehicle import GRAVITY_MPS2, VehicleType, parameter_column

if TYPE_CHECKING:
    from collections.abc import Sequence

Array = NDArray[np.float64]

TICK_S = 0.02  # telemetry's grain: 50 Hz
STEP_TICKS = 5  # the controls decide at 10 Hz, as fast as guidance sends; in between the motion is exact
STEP_S = STEP_TICKS * TICK_S
_POWER_STEP_MPS = 0.05
_POWER_TOP_MPS = 80.0  # a free fall's airspeed stays under it
_POWER_TABLE_W: Array = np.asarray(propulsion_power_w(np.arange(0.0, _POWER_TOP_MPS, _POWER_STEP_MPS)))


@dataclass(frozen=True, slots=True)
class Air:
    """What the air does: a steady wind and gusts on top of it."""

    wind_ne_mps: tuple[float, float] = (0.0, 0.0)  # where the air moves to
    gust_w20_mps: float = 0.0  # Dryden's wind at 20 ft: 7.7 light, 15.4 moderate, 23.2 severe (MIL-F-8785C); 0 none
    seed: int = 0


CALM = Air()


class Fleet:
    """Motion of N vehicles. Positions are NED metres from each vehicle's own pad, velocities over ground."""

    def __init__(self, types: Sequence[VehicleType], air: Air = CALM) -> None:
        """One type a vehicle; all in one air."""
        count = len(types)
        self.types = list(types)
        self.air = air
        columns = {kind: parameter_column(kind, STEP_S) for kind in set(types)}
        self._limits: Array = np.ascontiguousarray(np.array([columns[kind] for kind in types]).T)
        self._state: Array = np.zeros((layout.STATE_ROWS, count))
        self._command: Array = np.zeros((layout.COMMAND_ROWS, count))
        self._command[layout.CMD_YAW] = np.nan
        self._wind: Array = np.tile(np.array(air.wind_ne_mps)[:, None], (1, count))
        self._ticks = 0

    def __len__(self) -> int:
        return len(self.types)

    @property
    def pos_ned_m(self) -> Array:
        """[N, 3] view: north, east, down from the pad."""
        return self._state[layout.POS : layout.POS + 3].T

    @property
    def vel_ned_mps(self) -> Array:
        """[N, 3] view: velocity over ground."""
        return self._state[layout.VEL : layout.VEL + 3].T

    @property
    def used_j(self) -> Array:
        """[N] view: energy taken from the battery so far."""
        row: Array = self._state[layout.USED_J]
        return row

    @property
    def power_w(self) -> Array:
        """[N] view: present propulsion power."""
        row: Array = self._state[layout.POWER_W]
        return row

    @property
    def yaw_rad(self) -> Array:
        """[N] view: where the nose points, clockwise from north."""
        row: Array = self._state[layout.YAW]
        return row

    @property
    def command(self) -> Array:
        """[N, COMMAND_ROWS] view: velocity NED (m/s), yaw (rad, NaN holds), motors (0 off, 1 on)."""
        return self._command.T

    def column(self, i: int) -> Array:
        """Vehicle `i`'s state, a view in the layout's order."""
        column: Array = self._state[:, i]
        return column

    def attitude_rad(self, i: int) -> tuple[float, float, float]:
        """Roll, pitch, yaw of vehicle `i`: the lean that gives its horizontal acceleration."""
        column = self._state[:, i]
        share = (self._ticks % STEP_TICKS or STEP_TICKS) / STEP_TICKS
        was, now = column[layout.LEAN_WAS : layout.LEAN_WAS + 2], column[layout.LEAN : layout.LEAN + 2]
        north, east = (was + share * (now - was)).tolist()
        yaw = float(column[layout.YAW])
        forward = north * cos(yaw) + east * sin(yaw)
        right = east * cos(yaw) - north * sin(yaw)
        return atan(right / GRAVITY_MPS2), -atan(forward / GRAVITY_MPS2), yaw

    def set_limits(self, i: int, kind: VehicleType) -> None:
        """Changes what vehicle `i` can do, e.g. after a parameter was set."""
        self.types[i] = kind
        self._limits[:, i] = parameter_column(kind, STEP_S)

    @property
    def decides(self) -> bool:
        """Whether the next tick begins a step: the commands that stand now count for all of it."""
        return self._ticks % STEP_TICKS == 0

    def advance(self, ticks: int) -> None:
        """Moves all vehicles on by `ticks` ticks of TICK_S under the present commands."""
        kernel.advance(
            self._state,
            self._command,
            self._limits,
            self._wind,
            _POWER_TABLE_W,
            _POWER_STEP_MPS,
            TICK_S,
            STEP_TICKS,
            self._ticks,
            ticks,
            self.air.gust_w20_mps,
            self.air.seed,
        )
        self._ticks += ticks

    def place(self, pos_ned_m: Array, vel_ned_mps: Array) -> None:
        """Puts all vehicles at [N, 3] with velocities [N, 3], flying steadily, with full batteries; a step begins."""
        self._state[:] = 0.0
        self.pos_ned_m[:] = pos_ned_m
        self.vel_ned_mps[:] = vel_ned_mps
        self._state[layout.VEL_WISH : layout.VEL_WISH + 3] = np.transpose(vel_ned_mps)
        self._ticks = 0


def wind_ne(speed_mps: float, from_deg: float) -> tuple[float, float]:
    """Meteorological wind (where it comes from) to the air's velocity north, east."""
    return -speed_mps * cos(radians(from_deg)), -speed_mps * sin(radians(from_deg))


def course_rad(vel_ne: Sequence[float]) -> float:
    """Direction of travel clockwise from north, in [0, 2 pi); 0 at rest."""
    north, east = vel_ne
    return atan2(east, north) % (2 * np.pi) if hypot(north, east) > 1e-3 else 0.0
