"""What is known at the start of a slot (s_t), and what is decided then (a_t)."""

from dataclasses import dataclass

import numpy as np

from policy.world.arrays import Array
from policy.world.frames import velocity_enu_mps
from policy.world.freshness import INITIAL_AOI_SLOTS
from policy.world.scenario import Scenario


@dataclass(frozen=True)
class WorldState:
    """State at the beginning of slot ``slot`` (0 before the first). Leading batch dimensions are allowed."""

    slot: int
    uav_pos_enu_m: Array  # [..., U, 2]
    uav_vel_enu_mps: Array  # [..., U, 2]
    uav_energy_j: Array  # [..., U] remaining
    uav_active: Array  # bool [..., U]: in the air and serving
    user_pos_enu_m: Array  # [..., M, 2] sample t, never later
    user_data_mb: Array  # [..., M] megabits not yet uploaded
    user_aoi_slots: Array  # [..., M]
    user_active: Array  # bool [..., M]: taking part


@dataclass(frozen=True)
class JointAction:
    """Heading (clockwise from north) and speed to be flown by each UAV through the slot: [..., U] each.

    ``end_*``: at which the slot is left, where that is not the same (a turn or braking begun before the slot ends).
    """

    heading_rad: Array
    speed_mps: Array
    end_heading_rad: Array | None = None
    end_speed_mps: Array | None = None

    def __post_init__(self) -> None:
        """Half an end velocity is none."""
        if (self.end_heading_rad is None) != (self.end_speed_mps is None):
            raise ValueError("end_heading_rad and end_speed_mps belong together: give both or neither")

    @property
    def vel_enu_mps(self) -> Array:
        """Commanded velocity [..., U, 2]."""
        return velocity_enu_mps(self.heading_rad, self.speed_mps)

    @property
    def end_vel_enu_mps(self) -> Array | None:
        """Velocity at which the slot is to be left [..., U, 2]; None: the one commanded."""
        if self.end_heading_rad is None or self.end_speed_mps is None:
            return None
        return velocity_enu_mps(self.end_heading_rad, self.end_speed_mps)


def initial_state(scenario: Scenario, user_pos_enu_m: Array) -> WorldState:
    """Full batteries at the launch points, no data, AoI 1: positions [M, 2] -> state without batch."""
    num_uavs, num_users = scenario.num_uavs, int(user_pos_enu_m.shape[-2])
    return WorldState(
        slot=0,
        uav_pos_enu_m=np.array(scenario.launch_enu_m, dtype=np.float64),
        uav_vel_enu_mps=np.zeros((num_uavs, 2)),
        uav_energy_j=np.full(num_uavs, scenario.battery_j),
        uav_active=np.ones(num_uavs, dtype=np.bool_),
        user_pos_enu_m=np.array(user_pos_enu_m, dtype=np.float64),
        user_data_mb=np.zeros(num_users),
        user_aoi_slots=np.full(num_users, INITIAL_AOI_SLOTS),
        user_active=np.ones(num_users, dtype=np.bool_),
    )
