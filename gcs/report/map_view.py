"""The campaign's map as shapes in SVG user units: one unit is one metre, north is up."""

import math
from dataclasses import dataclass
from itertools import pairwise

from gcs.ports import UavSlot
from gcs.report.aoi_scale import aoi_step
from gcs.report.data import ReportData

TRACK_STYLES = 5
"""Colours in the style sheet; further UAVs repeat them with a dashed line."""

TRACK_PIECES = 6
"""A way is drawn in this many pieces, older ones fainter, so that the latest part stays readable."""

Point = tuple[float, float]


@dataclass(frozen=True)
class TrackPiece:
    """Part of a way; ``opacity`` grows with time."""

    points: str
    opacity: float


@dataclass(frozen=True)
class ObstacleShape:
    """A building's outline; ``blocks`` when it reaches the height at which the UAVs fly."""

    name: str
    points: str
    label_at: Point
    height_m: float
    blocks: bool


@dataclass(frozen=True)
class UserMark:
    """A user at the end."""

    at: Point
    step: int
    title: str


@dataclass(frozen=True)
class Track:
    """A UAV's way, with its place and heading at the end."""

    system_id: int
    style: int
    dashed: bool
    pieces: tuple[TrackPiece, ...]
    start: Point
    end: Point
    heading_deg: float
    active: bool


@dataclass(frozen=True)
class MapView:
    """Everything that the template draws."""

    width_m: float
    height_m: float
    unit_m: float  # a screen pixel's worth of metres when the map is about 900 pixels wide
    margin_m: float
    obstacles: tuple[ObstacleShape, ...]
    users: tuple[UserMark, ...]
    tracks: tuple[Track, ...]
    serving_radius_m: float
    scale_bar_m: float


def map_view(data: ReportData) -> MapView:
    """Shapes of the area, the buildings, the users at the end and every UAV's way."""
    width_m, height_m = data.scenario.area.size_m
    unit_m = width_m / 900.0
    return MapView(
        width_m=width_m,
        height_m=height_m,
        unit_m=unit_m,
        margin_m=24.0 * unit_m,
        obstacles=_obstacles(data),
        users=_users(data),
        tracks=tuple(_track(data, index) for index in range(len(data.records[0].uavs))),
        serving_radius_m=data.scenario.serving_radius_m,
        scale_bar_m=scale_bar_m(width_m),
    )


def scale_bar_m(width_m: float) -> float:
    """The greatest 1, 2 or 5 times a power of ten that is at most a quarter of the width."""
    power = 10.0 ** math.floor(math.log10(width_m / 4.0))
    return max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= width_m / 4.0)


def _flip(data: ReportData, east_m: float, north_m: float) -> Point:
    return (round(east_m, 1), round(data.scenario.area.size_m[1] - north_m, 1))


def _points(data: ReportData, points_m: list[Point]) -> str:
    return " ".join(f"{x:g},{y:g}" for x, y in (_flip(data, *point) for point in points_m))


def _obstacles(data: ReportData) -> tuple[ObstacleShape, ...]:
    blocking = {obstacle.name for obstacle in data.scenario.blocking_obstacles}
    shapes = []
    for obstacle in data.scenario.area.obstacles:
        corners = [(float(east), float(north)) for east, north in obstacle.polygon_m]
        foot = (sum(e for e, _ in corners) / len(corners), min(n for _, n in corners))
        shapes.append(
            ObstacleShape(
                name=obstacle.name,
                points=_points(data, corners),
                label_at=_flip(data, *foot),
                height_m=obstacle.height_m,
                blocks=obstacle.name in blocking,
            )
        )
    return tuple(shapes)


def _users(data: ReportData) -> tuple[UserMark, ...]:
    """Oldest last, so that they lie on top; who left, and everybody once places are wiped, has no place."""
    placed = [user for user in data.records[-1].users if not math.isnan(user.east_m)]
    users = sorted(placed, key=lambda user: user.aoi_slots)
    return tuple(
        UserMark(
            at=_flip(data, user.east_m, user.north_m),
            step=aoi_step(user.aoi_slots),
            title=f"{user.user_id}: AoI {user.aoi_slots:g} slots, {user.data_mb:.2f} Mbit waiting",
        )
        for user in users
    )


def _track(data: ReportData, index: int) -> Track:
    uavs = [record.uavs[index] for record in data.records]
    first, last = uavs[0], uavs[-1]
    return Track(
        system_id=last.system_id,
        style=index % TRACK_STYLES,
        dashed=index >= TRACK_STYLES,
        pieces=_pieces(data, [_place(uav) for uav in uavs]),
        start=_flip(data, *_place(first)),
        end=_flip(data, *_place(last)),
        heading_deg=round(last.heading_deg, 1),
        active=last.active,
    )


def _pieces(data: ReportData, points_m: list[Point]) -> tuple[TrackPiece, ...]:
    """Pieces of about equal length in time; each begins where the one before ends."""
    legs = len(points_m) - 1
    bounds = [round(legs * k / TRACK_PIECES) for k in range(TRACK_PIECES + 1)]
    return tuple(
        TrackPiece(_points(data, points_m[begin : end + 1]), round(0.25 + 0.7 * k / (TRACK_PIECES - 1), 2))
        for k, (begin, end) in enumerate(pairwise(bounds))
        if end > begin
    )


def _place(uav: UavSlot) -> Point:
    return (uav.east_m, uav.north_m)
