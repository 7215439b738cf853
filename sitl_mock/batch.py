"""B campaigns x U vehicles in lock step: the same physics without the wire, for training."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sitl_mock.physics.fleet import CALM, TICK_S, Air, Fleet
from sitl_mock.physics.vehicle import M600, VehicleType

Array = NDArray[np.float64]


class BatchFleet:
    """Vehicles that are in the air from the start. Row b * U + u of the fleet is vehicle u of campaign b."""

    def __init__(
        self,
        campaigns: int,
        vehicles: int,
        kind: VehicleType = M600,
        *,
        alt_m: float = 120.0,
        air: Air = CALM,
    ) -> None:
        """`alt_m` is the height above the pads."""
        self.shape = (campaigns, vehicles)
        self._alt_m = alt_m
        self._fleet = Fleet([kind] * (campaigns * vehicles), air)
        self.reset()

    def reset(self, pos_ne_m: Array | None = None, vel_ned_mps: Array | None = None) -> None:
        """Starts anew with full batteries at [B, U, 2] metres north, east (the origin if omitted)."""
        pos = np.zeros((*self.shape, 3))
        pos[..., 2] = -self._alt_m
        if pos_ne_m is not None:
            pos[..., :2] = pos_ne_m
        vel = np.zeros((*self.shape, 3)) if vel_ned_mps is None else np.broadcast_to(vel_ned_mps, pos.shape)
        self._fleet.place(pos.reshape(-1, 3), np.ascontiguousarray(vel).reshape(-1, 3))
        self._fleet.command[:, 4] = 1.0

    @property
    def pos_ned_m(self) -> Array:
        """[B, U, 3] copy: north, east, down metres from the pads."""
        return self._fleet.pos_ned_m.reshape(*self.shape, 3)

    @property
    def vel_ned_mps(self) -> Array:
        """[B, U, 3] copy."""
        return self._fleet.vel_ned_mps.reshape(*self.shape, 3)

    @property
    def used_j(self) -> Array:
        """[B, U] energy used since the reset."""
        return self._fleet.used_j.reshape(self.shape)

    def step(self, cmd_vel_ned_mps: Array, ticks: int) -> None:
        """Flies [B, U, 3] velocities for `ticks` ticks of TICK_S; the controls hear them once a step (0.1 s)."""
        self._fleet.command[:, :3] = np.asarray(cmd_vel_ned_mps, dtype=np.float64).reshape(-1, 3)
        self._fleet.advance(ticks)

    def step_slot(self, cmd_vel_ned_mps: Array, slot_s: float = 15.0) -> Array:
        """Flies constant velocities for one slot (a multiple of TICK_S); returns the positions [B, U, 3]."""
        self.step(cmd_vel_ned_mps, round(slot_s / TICK_S))
        return self.pos_ned_m
