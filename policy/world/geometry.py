"""Points, paths and polygons on the plane."""

from collections.abc import Sequence

from policy.world.arrays import Array, array_namespace, norm

Polygon = tuple[tuple[float, float], ...]
"""Corners (east_m, north_m) in order, not repeated at the end."""


def inside_rectangle(points_m: Array, size_m: tuple[float, float], margin_m: float = 0.0) -> Array:
    """Within [margin, size - margin] on both axes: [..., 2] -> bool [...]; the edge itself is inside."""
    east, north = points_m[..., 0], points_m[..., 1]
    return (east >= margin_m) & (east <= size_m[0] - margin_m) & (north >= margin_m) & (north <= size_m[1] - margin_m)


def inside_polygon(points_m: Array, polygon_m: Polygon) -> Array:
    """Even-odd rule: [..., 2] -> bool [...]; points on an edge may fall either way."""
    xp = array_namespace(points_m)
    east, north = points_m[..., 0], points_m[..., 1]
    inside = xp.zeros_like(east) > 0.0
    for (e0, n0), (e1, n1) in _edges(polygon_m):
        if n0 == n1:
            continue
        spans = (n0 > north) != (n1 > north)
        crossing_east = e0 + (north - n0) * (e1 - e0) / (n1 - n0)
        inside = inside ^ (spans & (east < crossing_east))
    return inside


def distance_to_polygon_m(points_m: Array, polygon_m: Polygon) -> Array:
    """Distance to the nearest edge, 0 inside: [..., 2] -> [...]."""
    xp = array_namespace(points_m)
    nearest = xp.zeros_like(points_m[..., 0]) + float("inf")
    for start, end in _edges(polygon_m):
        distance = _distance_to_segment_m(points_m, start, end)
        nearest = xp.where(distance < nearest, distance, nearest)
    return xp.where(inside_polygon(points_m, polygon_m), xp.zeros_like(nearest), nearest)


def polygon_area_m2(polygon_m: Polygon) -> float:
    """Shoelace formula, positive for either orientation."""
    return abs(0.5 * sum(e0 * n1 - e1 * n0 for (e0, n0), (e1, n1) in _edges(polygon_m)))


def pairwise_distance_m(first_m: Array, second_m: Array) -> Array:
    """[..., U, 2], [..., M, 2] -> [..., U, M]."""
    return norm(first_m[..., :, None, :] - second_m[..., None, :, :])


def _edges(polygon_m: Sequence[tuple[float, float]]) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    return list(zip(polygon_m, [*polygon_m[1:], polygon_m[0]], strict=True))


def _distance_to_segment_m(points_m: Array, start: tuple[float, float], end: tuple[float, float]) -> Array:
    xp = array_namespace(points_m)
    along = (end[0] - start[0], end[1] - start[1])
    length_2 = along[0] ** 2 + along[1] ** 2
    east, north = points_m[..., 0] - start[0], points_m[..., 1] - start[1]
    share = xp.clip((east * along[0] + north * along[1]) / (length_2 if length_2 > 0.0 else 1.0), 0.0, 1.0)
    d_east, d_north = east - share * along[0], north - share * along[1]
    return xp.sqrt(d_east * d_east + d_north * d_north)
