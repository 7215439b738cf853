"""What a forecast of users' places reads: own ways of the last K slots, and where the crowd stands.

Everything is seen from the user along its own way, so that what was learned of walking east serves for any bearing.
"""

from dataclasses import dataclass

import numpy as np

from policy.world.arrays import BoolArray, FloatArray, IntArray

HISTORY_SLOTS = 8
"""K: two minutes of slots of 15 s."""
CROWD_M = (50.0, 150.0, 500.0)
"""Reach of the bells by which the others are counted: a room, a building, a part of the campus."""
STOOD_M = 3.0
"""A shorter way is a receiver's error rather than a step."""
STILL_M = 1.0
"""Who came no farther in K slots has no bearing; east is taken."""
FAINT = 0.1
"""Of one neighbour: keeps the pull of a few far ones small."""
FORECAST_FEATURES = 4 * HISTORY_SLOTS - HISTORY_SLOTS + 3 + 3 * len(CROWD_M)


@dataclass(frozen=True)
class Seen:
    """B moments of M users, as :class:`policy.model.history.StepHistory` keeps them (B = 1 in flight)."""

    pos_enu_m: FloatArray  # [B, M, 2]
    steps_m: FloatArray  # [B, M, K, 2] newest first
    known_slots: IntArray  # [B, M]
    active: BoolArray  # [B, M]


def forecast_features(seen: Seen, walk_m: float) -> tuple[FloatArray, FloatArray]:
    """Features [B, M, F] and each user's bearing as a unit vector [B, M, 2]; ``walk_m``: a walker's way in a slot."""
    net_m = np.sum(seen.steps_m, axis=2)
    way_m = np.linalg.norm(net_m, axis=-1, keepdims=True)
    bearing = np.where(way_m > STILL_M, net_m / np.maximum(way_m, STILL_M), np.array([1.0, 0.0]))
    length_m = np.linalg.norm(seen.steps_m, axis=-1)
    steps = np.arcsinh(turned(seen.steps_m, bearing[:, :, None]) / walk_m)
    columns = (
        steps.reshape(*steps.shape[:2], -1),
        np.arcsinh(4.0 * length_m / walk_m),
        np.arcsinh(way_m / walk_m),
        np.mean(length_m > STOOD_M, axis=2)[..., None],
        (seen.known_slots / HISTORY_SLOTS)[..., None],
        *_crowd(seen, bearing),
    )
    return np.concatenate(columns, axis=-1), bearing


def turned(vector: FloatArray, bearing: FloatArray) -> FloatArray:
    """East, north [..., 2] -> along, left of ``bearing`` [..., 2]."""
    along = vector[..., 0] * bearing[..., 0] + vector[..., 1] * bearing[..., 1]
    left = vector[..., 1] * bearing[..., 0] - vector[..., 0] * bearing[..., 1]
    return np.stack((along, left), axis=-1)


def turned_back(vector: FloatArray, bearing: FloatArray) -> FloatArray:
    """Along, left of ``bearing`` -> east, north."""
    return turned(vector, bearing * np.array([1.0, -1.0]))


def _crowd(seen: Seen, bearing: FloatArray) -> list[FloatArray]:
    """For each reach where the others are on average [B, M, 2] and how many [B, M, 1].

    In float32, whose exponential runs on vector units: bells of M x M are most of a forecast's time.
    """
    centred_m = seen.pos_enu_m - np.mean(seen.pos_enu_m, axis=1, keepdims=True)  # small numbers lose no digits below
    place_m = centred_m.astype(np.float32)
    east_m, north_m = place_m[..., 0], place_m[..., 1]
    square_m2 = (east_m[:, None] - east_m[:, :, None]) ** 2 + (north_m[:, None] - north_m[:, :, None]) ** 2
    others = (seen.active[:, None, :] & ~np.eye(place_m.shape[1], dtype=np.bool_)).astype(np.float32)
    columns = []
    for reach_m in CROWD_M:
        weight = np.exp(square_m2 * np.float32(-0.5 / reach_m**2)) * others
        count = np.sum(weight, axis=2, keepdims=True)
        pull = (weight @ place_m - count * place_m) / ((count + np.float32(FAINT)) * np.float32(reach_m))
        columns += [turned(pull.astype(np.float64), bearing), np.log1p(count.astype(np.float64))]
    return columns
