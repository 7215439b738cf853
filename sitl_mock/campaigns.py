"""B campaigns in lock step: the mock's physics under the paper's system model, for training.

The whole slot is compiled. What the world says once (Eq. 1-4) is taken from it: who is served follows from its
serving radius, because the loss grows with distance; a test holds data and AoI to `policy.world.transition`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numpy.typing import NDArray

from policy.world.channel import serving_radius_m
from policy.world.freshness import INITIAL_AOI_SLOTS
from sitl_mock.batch import BatchFleet
from sitl_mock.physics.fleet import CALM, TICK_S, Air
from sitl_mock.physics.vehicle import M600, VehicleType

if TYPE_CHECKING:
    from policy.world.scenario import Scenario

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


@njit(cache=True, error_model="numpy")
def _serve(
    uavs_m: Array,
    flying: Flags,
    users_m: Array,
    square_m2: float,
    new_mb: Array,
    data_mb: Array,
    aoi: Array,
    served: Flags,
) -> None:
    """Eq. 3 and 4 for all campaigns: uavs [B, U, 2], users [M, 2], new_mb [M]; data, aoi, served [B, M] change."""
    for b in range(uavs_m.shape[0]):
        for m in range(users_m.shape[0]):
            reached = False
            for u in range(uavs_m.shape[1]):
                east, north = uavs_m[b, u, 0] - users_m[m, 0], uavs_m[b, u, 1] - users_m[m, 1]
                reached = reached or (flying[b, u] and east * east + north * north <= square_m2)
            served[b, m] = reached
            data_mb[b, m] = 0.0 if reached else data_mb[b, m] + new_mb[m]
            aoi[b, m] = 1.0 if reached else aoi[b, m] + 1.0


class BatchCampaigns:
    """The same scenario and trace flown by B fleets at once, each with its own decisions."""

    def __init__(
        self, scenario: Scenario, users_enu_m: Array, campaigns: int, kind: VehicleType = M600, air: Air = CALM
    ) -> None:
        """`users_enu_m` [T + 1, M, 2]: where the users are at the samples."""
        uavs = len(scenario.launch_enu_m)
        self._scenario, self._users_m = scenario, np.ascontiguousarray(users_enu_m, dtype=np.float64)
        self._fleet = BatchFleet(campaigns, uavs, kind, alt_m=scenario.altitude_m, air=air)
        self._square_m2 = serving_radius_m(scenario.altitude_m, scenario.radio) ** 2
        self._new_mb: Array = np.asarray(scenario.collect_mbps, dtype=np.float64) * scenario.slot_s
        self._velocities: Array = np.zeros((campaigns, uavs, 3))
        users = self._users_m.shape[1]
        self.slot = 0
        self.data_mb: Array = np.zeros((campaigns, users))
        self.aoi_slots: Array = np.full((campaigns, users), INITIAL_AOI_SLOTS)
        self.served: Flags = np.zeros((campaigns, users), dtype=np.bool_)
        self.reset()

    def reset(self) -> None:
        """Starts all campaigns anew, hovering over the launch points with full batteries."""
        self._fleet.reset(np.asarray(self._scenario.launch_enu_m)[:, ::-1])
        self.slot = 0
        self.data_mb[:] = 0.0
        self.aoi_slots[:] = INITIAL_AOI_SLOTS
        self.served[:] = False

    @property
    def slots(self) -> int:
        """T: how many slots the trace holds."""
        return len(self._users_m) - 1

    @property
    def uav_pos_enu_m(self) -> Array:
        """[B, U, 2] copy."""
        return np.ascontiguousarray(self._fleet.pos_ned_m[..., 1::-1])

    @property
    def uav_vel_enu_mps(self) -> Array:
        """[B, U, 2] copy."""
        return np.ascontiguousarray(self._fleet.vel_ned_mps[..., 1::-1])

    @property
    def uav_energy_j(self) -> Array:
        """[B, U] energy left, not below zero."""
        return np.maximum(self._scenario.battery_j - self._fleet.used_j, 0.0)

    def step(self, vel_enu_mps: Array) -> None:
        """Flies velocities [B, U, 2] through one slot, then serves. An empty UAV hovers and serves nobody.

        Raises IndexError after the last slot of the trace.
        """
        users_m = self._users_m[self.slot + 1]
        before = self.uav_energy_j > 0.0
        self._velocities[..., 0] = np.where(before, vel_enu_mps[..., 1], 0.0)
        self._velocities[..., 1] = np.where(before, vel_enu_mps[..., 0], 0.0)
        self._fleet.step(self._velocities, round(self._scenario.slot_s / TICK_S))
        flying = self.uav_energy_j > 0.0
        uavs_m = self.uav_pos_enu_m
        _serve(uavs_m, flying, users_m, self._square_m2, self._new_mb, self.data_mb, self.aoi_slots, self.served)
        self.slot += 1
