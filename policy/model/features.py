"""What the embeddings f^UAV and f^user of Eq. 11a-b read, without units and around the size of one.

The paper's s^u and s^m (place, energy; place, data, AoI), places relative to the users' middle in units of the
way flown in a slot, and quantities that follow from them (way to the nearest UAV, slots until it could serve),
so that weights learned in one place fit another.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from policy.model.states import STEPS, StateBatch, Units
from policy.model.user_rows import Crowd, Scales, user_rows
from policy.world.arrays import FloatArray

Float32Array: TypeAlias = npt.NDArray[np.float32]

UAV_FEATURES = 8
USER_FEATURES = 11 + 2 * STEPS
USER_STEP_COLUMN = 2
USER_LOG_AOI_COLUMN, USER_AOI_COLUMN, USER_LOG_DATA_COLUMN, USER_SLOTS_COLUMN = (
    columns + 2 * STEPS for columns in (2, 3, 4, 8)
)
UAV_ACTION_FEATURES = 2
FEATURE_VERSION = 3
"""Of what the network reads and in which order: weights of another one mean something else."""

AOI_SCALE_SLOTS = 30.0
LEAST_SLOT_MB = 1e-6  # a user who collects nothing has nothing
MAX_WALKS = 15.0  # of a step: faster than any vehicle on a campus, a position error
FAR = 20.0  # in slots' ways: the distance given when no UAV flies


@dataclass(frozen=True)
class Features:
    """Inputs of the network: ``uav`` [B, U, 8], ``user`` [B, M, 19], masks 1 (takes part) or 0, float32."""

    uav: Float32Array
    user: Float32Array
    uav_mask: Float32Array  # [B, U]
    user_mask: Float32Array  # [B, M]


def make_features(states: StateBatch, units: Units) -> Features:
    """A batch of states of one campaign -> network inputs."""
    middle_m = _middle_m(states)
    return Features(
        uav=_uav_features(states, units, middle_m),
        user=_user_features(states, units, middle_m),
        uav_mask=states.uav_active.astype(np.float32),
        user_mask=states.user_active.astype(np.float32),
    )


def action_features(vel_command_mps: FloatArray, units: Units) -> Float32Array:
    """Commanded velocities [B, U, 2] -> in units of the greatest speed."""
    return np.asarray(vel_command_mps / units.max_speed_mps, dtype=np.float32)


def _middle_m(states: StateBatch) -> FloatArray:
    """Mean place of users that take part [B, 1, 2]."""
    weight = states.user_active[..., None].astype(np.float64)
    total = np.sum(states.user_pos_enu_m * weight, axis=1, keepdims=True)
    return np.asarray(total / np.maximum(np.sum(weight, axis=1, keepdims=True), 1.0))


def _uav_features(states: StateBatch, units: Units, middle_m: FloatArray) -> Float32Array:
    batch, uavs = states.uav_energy_j.shape
    flying = np.log1p(np.sum(states.uav_active, axis=1, keepdims=True))
    columns = (
        (states.uav_pos_enu_m - middle_m) / units.reach_m,
        states.uav_vel_enu_mps / units.max_speed_mps,
        (states.uav_energy_j / units.battery_j)[..., None],
        np.full((batch, uavs, 1), units.serving_radius_m / units.reach_m),
        np.broadcast_to(flying[..., None], (batch, uavs, 1)),
        np.full((batch, uavs, 1), units.turn_slots),
    )
    return np.concatenate(columns, axis=-1).astype(np.float32)


def _user_features(states: StateBatch, units: Units, middle_m: FloatArray) -> Float32Array:
    whole = np.ascontiguousarray  # one compiled form for all
    crowd = Crowd(
        user_m=whole(states.user_pos_enu_m),
        steps_m=whole(states.user_steps_m),
        aoi_slots=whole(states.user_aoi_slots),
        data_mb=whole(states.user_data_mb),
        uav_m=whole(states.uav_pos_enu_m),
        flies=whole(states.uav_active),
        middle_m=whole(middle_m),
        slot_mb=np.maximum(units.slot_data_mb, LEAST_SLOT_MB),
    )
    scales = Scales(
        units.reach_m, units.walk_m, units.serving_radius_m / units.reach_m, MAX_WALKS, AOI_SCALE_SLOTS, FAR
    )
    return user_rows(crowd, scales)
