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
from policy.world.arrays import FloatArray
from policy.world.geometry import pairwise_distance_m

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
    to_nearest, nearest, second = _ways_to_uavs(states, units)
    radius = units.serving_radius_m / units.reach_m
    steps = states.user_steps_m.reshape(*states.user_steps_m.shape[:2], 2 * STEPS)
    columns = (
        (states.user_pos_enu_m - middle_m) / units.reach_m,
        np.clip(steps / units.walk_m, -MAX_WALKS, MAX_WALKS),
        (np.log(np.maximum(states.user_aoi_slots, 1.0)) / np.log(AOI_SCALE_SLOTS))[..., None],
        (states.user_aoi_slots / AOI_SCALE_SLOTS)[..., None],
        (np.log1p(states.user_data_mb / np.maximum(units.slot_data_mb, LEAST_SLOT_MB)) / np.log(AOI_SCALE_SLOTS))[
            ..., None
        ],
        to_nearest,
        nearest[..., None],
        np.maximum(nearest - radius, 0.0)[..., None],
        np.maximum(second - radius, 0.0)[..., None],
        np.full((*nearest.shape, 1), radius),
    )
    return np.concatenate(columns, axis=-1).astype(np.float32)


def _ways_to_uavs(states: StateBatch, units: Units) -> tuple[FloatArray, FloatArray, FloatArray]:
    """In slots' ways: vector to the nearest flying UAV [B, M, 2], its length, the second's distance [B, M]."""
    distance = pairwise_distance_m(states.uav_pos_enu_m, states.user_pos_enu_m) / units.reach_m
    distance = np.minimum(np.where(states.uav_active[..., None], distance, FAR), FAR)
    index = np.argmin(distance, axis=1)
    place_m = np.take_along_axis(states.uav_pos_enu_m, index[..., None], axis=1)
    vector = (place_m - states.user_pos_enu_m) / units.reach_m
    nearest = np.take_along_axis(distance, index[:, None, :], axis=1)[:, 0, :]
    vector = np.where((nearest < FAR)[..., None], vector, 0.0)
    if distance.shape[1] == 1:
        return vector, nearest, np.full_like(nearest, FAR)
    return vector, nearest, np.partition(distance, 1, axis=1)[:, 1, :]
