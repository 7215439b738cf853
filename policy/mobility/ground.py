"""Where people can walk: inside the area, not through obstacles."""

from dataclasses import dataclass

import numpy as np

from policy.world.arrays import BoolArray, FloatArray
from policy.world.geometry import Polygon, inside_polygon, inside_rectangle


@dataclass(frozen=True)
class Ground:
    """A rectangle from (0, 0) with polygons left out."""

    area_size_m: tuple[float, float]
    obstacles: tuple[Polygon, ...] = ()

    def free(self, points_m: FloatArray) -> BoolArray:
        """Inside the area and in no obstacle: [..., 2] -> [...]."""
        free = np.asarray(inside_rectangle(points_m, self.area_size_m), dtype=np.bool_)
        for polygon in self.obstacles:
            free = free & ~inside_polygon(points_m, polygon)
        return free

    def clear_way(self, start_m: FloatArray, end_m: FloatArray) -> bool:
        """The straight way from ``start_m`` to ``end_m``, [2] each, stays free (start is known to be)."""
        if not self.free(end_m):
            return False
        return not any(_crosses(start_m, end_m, polygon) for polygon in self.obstacles)


def _crosses(start_m: FloatArray, end_m: FloatArray, polygon_m: Polygon) -> bool:
    """The segment meets an edge: ends on both sides of each other's line; touching counts."""
    corners = np.asarray(polygon_m, dtype=np.float64)
    following = np.roll(corners, -1, axis=0)
    across_way = _side(start_m, end_m, corners) * _side(start_m, end_m, following)
    across_edge = _side(corners, following, start_m) * _side(corners, following, end_m)
    return bool(np.any((across_way <= 0.0) & (across_edge <= 0.0)))


def _side(start_m: FloatArray, end_m: FloatArray, point_m: FloatArray) -> FloatArray:
    """Cross product: > 0 where the point lies left of the line, [..., 2] each -> [...]."""
    along, aside = end_m - start_m, point_m - start_m
    return np.asarray(along[..., 0] * aside[..., 1] - along[..., 1] * aside[..., 0])
