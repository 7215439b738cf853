"""What a forecast of users' places reads: own ways of the last K slots, and where the crowd stands.

Everything is seen from the user along its own way, so that what was learned of walking east serves for any bearing.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from policy.model.features import Float32Array
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
OWN_WAYS = 3 * HISTORY_SLOTS + 1
"""Along and left of each slot, their lengths, and that of all together."""
FORECAST_FEATURES = OWN_WAYS + 2 + 3 * len(CROWD_M)

EAST = np.array([1.0, 0.0])
REACH_M = np.array(CROWD_M, dtype=np.float32)[:, None, None, None]
BELL_PER_M2 = np.array([-0.5 / reach_m**2 for reach_m in CROWD_M], dtype=np.float32)[:, None, None, None]


@dataclass(frozen=True)
class Seen:
    """B moments of M users, as :class:`policy.model.history.StepHistory` keeps them (B = 1 in flight)."""

    pos_enu_m: FloatArray  # [B, M, 2]
    steps_m: FloatArray  # [B, M, K, 2] newest first
    known_slots: IntArray  # [B, M]
    active: BoolArray  # [B, M]


def forecast_features(seen: Seen, walk_m: float) -> tuple[FloatArray, FloatArray]:
    """Features [B, M, F] and each user's bearing as a unit vector [B, M, 2]; ``walk_m``: a walker's way in a slot.

    Columns are written where they belong: for one moment in flight each array made and each call count.
    """
    batch, users, slots, _ = seen.steps_m.shape
    features = np.empty((batch, users, FORECAST_FEATURES))
    net_m = np.add.reduce(seen.steps_m, axis=2)
    way_m, length_m = _lengths(net_m), _lengths(seen.steps_m)
    walked_m = way_m[..., None]
    bearing = np.where(walked_m > STILL_M, net_m / np.maximum(walked_m, STILL_M), EAST)
    ways = features[..., :OWN_WAYS]
    ways[..., : 2 * slots] = turned(seen.steps_m, bearing[:, :, None]).reshape(batch, users, 2 * slots)
    np.multiply(4.0, length_m, out=ways[..., 2 * slots : 3 * slots])
    ways[..., -1] = way_m
    np.divide(ways, walk_m, out=ways)
    np.arcsinh(ways, out=ways)
    features[..., OWN_WAYS] = np.add.reduce(length_m > STOOD_M, axis=2, dtype=np.float64) / slots
    features[..., OWN_WAYS + 1] = seen.known_slots / HISTORY_SLOTS
    _crowd(seen, bearing, features[..., OWN_WAYS + 2 :])
    return features, bearing


def turned(vector: FloatArray, bearing: FloatArray) -> FloatArray:
    """East, north [..., 2] -> along, left of ``bearing`` [..., 2]."""
    east, north, ahead_e, ahead_n = vector[..., 0], vector[..., 1], bearing[..., 0], bearing[..., 1]
    along = east * ahead_e + north * ahead_n
    both = np.empty((*along.shape, 2))
    both[..., 0] = along
    np.subtract(north * ahead_e, east * ahead_n, out=both[..., 1])
    return both


def turned_back(vector: FloatArray, bearing: FloatArray) -> FloatArray:
    """Along, left of ``bearing`` -> east, north."""
    return turned(vector, bearing * np.array([1.0, -1.0]))


def _lengths(vector: FloatArray) -> FloatArray:
    """[..., 2] -> [...]."""
    square = vector * vector
    return np.sqrt(square[..., 0] + square[..., 1])


def _crowd(seen: Seen, bearing: FloatArray, columns: FloatArray) -> None:
    """For each reach where the others are on average and how many, into ``columns`` [B, M, 3 R].

    In float32, whose exponential runs on vector units: bells of M x M are most of a forecast's time.
    """
    users = seen.active.shape[1]
    centred_m = seen.pos_enu_m - np.add.reduce(seen.pos_enu_m, axis=1, keepdims=True) / max(users, 1)
    place_m = centred_m.astype(np.float32)  # small numbers lose no digits below
    weight = BELL_PER_M2 * _squares_m2(place_m, seen.active)
    np.exp(weight, out=weight)
    count = np.add.reduce(weight, axis=-1, keepdims=True)  # [R, B, M, 1]
    pull = (weight @ place_m - count * place_m) / ((count + np.float32(FAINT)) * REACH_M)
    told = columns.reshape(*columns.shape[:2], len(CROWD_M), 3).transpose(2, 0, 1, 3)
    told[..., :2] = turned(pull.astype(np.float64), bearing)
    np.log1p(count[..., 0].astype(np.float64), out=told[..., 2])


def _squares_m2(place_m: Float32Array, active: BoolArray) -> Float32Array:
    """Squared distances [B, M, M] between places [B, M, 2]; infinite to oneself and to the absent (last axis), so that
    neither weighs anything.
    """
    east_m, north_m = np.array(place_m.transpose(2, 0, 1), order="C")
    square_m2: Float32Array = east_m[:, None] - east_m[:, :, None]
    north_m2 = north_m[:, None] - north_m[:, :, None]
    square_m2 *= square_m2
    north_m2 *= north_m2
    square_m2 += north_m2
    square_m2 += _to_oneself(active.shape[1])
    np.copyto(square_m2, np.inf, where=~active[:, None])
    return square_m2


@lru_cache(maxsize=8)
def _to_oneself(users: int) -> Float32Array:
    """[M, M]: infinite on the diagonal, else 0."""
    far: Float32Array = np.zeros((users, users), np.float32)
    np.fill_diagonal(far, np.inf)
    far.flags.writeable = False
    return far
