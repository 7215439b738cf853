"""What the network reads of each user, in one pass over users: a search asks for thousands of states a decision."""

from typing import NamedTuple

import numpy as np

from policy.model.compiled import compiled
from policy.world.arrays import BoolArray, FloatArray


class Scales(NamedTuple):
    """What places, steps, ages and data are measured against (``policy.model.features``)."""

    reach_m: float
    walk_m: float
    radius: float  # of serving, in reach
    most_walks: float  # of a step
    aoi_slots: float
    far: float  # the way given where no UAV flies, in reach


class Crowd(NamedTuple):
    """B states of M users and U UAVs as arrays, see ``StateBatch``; ``middle_m`` [B, 1, 2], ``slot_mb`` [M]."""

    user_m: FloatArray
    steps_m: FloatArray  # [B, M, K, 2]
    aoi_slots: FloatArray
    data_mb: FloatArray
    uav_m: FloatArray
    flies: BoolArray
    middle_m: FloatArray
    slot_mb: FloatArray


@compiled
def user_rows(crowd: Crowd, scales: Scales) -> "np.ndarray[tuple[int, ...], np.dtype[np.float32]]":
    """[B, M, 11 + 2 K] float32: place, K steps, log AoI, AoI, log data, vector to the nearest UAV that flies, its way,

    how far it and the second must come, serving radius; all in ``scales``.
    """
    states, users, steps = crowd.steps_m.shape[:3]
    rows = np.empty((states, users, 11 + 2 * steps), np.float32)
    log_scale = np.log(scales.aoi_slots)
    for state in range(states):
        for user in range(users):
            east_m, north_m = crowd.user_m[state, user, 0], crowd.user_m[state, user, 1]
            nearest, second = scales.far, scales.far
            to_east, to_north = 0.0, 0.0
            for uav in range(crowd.uav_m.shape[1]):
                if not crowd.flies[state, uav]:
                    continue
                to_m = crowd.uav_m[state, uav, 0] - east_m, crowd.uav_m[state, uav, 1] - north_m
                way = np.sqrt(to_m[0] * to_m[0] + to_m[1] * to_m[1]) / scales.reach_m
                if way < nearest:
                    nearest, second = way, nearest
                    to_east, to_north = to_m[0] / scales.reach_m, to_m[1] / scales.reach_m
                elif way < second:
                    second = way
            row = rows[state, user]
            row[0] = (east_m - crowd.middle_m[state, 0, 0]) / scales.reach_m
            row[1] = (north_m - crowd.middle_m[state, 0, 1]) / scales.reach_m
            for step in range(steps):
                for axis in range(2):
                    walks = crowd.steps_m[state, user, step, axis] / scales.walk_m
                    row[2 + 2 * step + axis] = min(max(walks, -scales.most_walks), scales.most_walks)
            last = 2 + 2 * steps
            row[last] = np.log(max(crowd.aoi_slots[state, user], 1.0)) / log_scale
            row[last + 1] = crowd.aoi_slots[state, user] / scales.aoi_slots
            row[last + 2] = np.log1p(crowd.data_mb[state, user] / crowd.slot_mb[user]) / log_scale
            row[last + 3], row[last + 4], row[last + 5] = to_east, to_north, nearest
            row[last + 6], row[last + 7] = max(nearest - scales.radius, 0.0), max(second - scales.radius, 0.0)
            row[last + 8] = scales.radius
    return rows
