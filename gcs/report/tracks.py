"""The campaign's ways for a map program: GeoJSON (RFC 7946) and KML 2.2 with moments (gx:Track).

Degrees are those of the mission's own frame. Heights are metres above each vehicle's home, in the mission's layers:
slot records have no height, and both formats' third coordinate means another one, so GeoJSON has it as a property.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any
from xml.etree import ElementTree as ET

from gcs.report.data import ReportData
from gcs.report.series import UserTotal, uav_totals, user_totals

KML = "http://www.opengis.net/kml/2.2"
GX = "http://www.google.com/kml/ext/2.2"
LINE_COLOURS = ("ffa8620b", "ff5a7a00", "ff863d9a", "ffc48f2f", "ff9e4d4d")  # aabbggrr: the page's track colours
DECIMALS = 7  # 1 cm
Position = tuple[float, float]  # longitude, latitude


@dataclass(frozen=True)
class Way:
    """One UAV or user over the slots; equally long tuples, one entry for each moment whose place is known."""

    name: str
    positions: tuple[Position, ...]
    slots: tuple[int, ...]
    times_s: tuple[float, ...]  # since slot 0


def geojson(data: ReportData, *, users: bool = True) -> dict[str, Any]:
    """A FeatureCollection: area, obstacles, a way for every UAV and, with ``users``, for every user."""
    features = [_area(data), *_obstacles(data), *_uavs(data)]
    if users:
        features += _users(data)
    return {"type": "FeatureCollection", "name": data.name, "features": features}


def kml(data: ReportData, *, users: bool = True) -> str:
    """The same as KML. Moments count from ``provenance.begun_utc``, in flight seconds."""
    for prefix, space in (("", KML), ("gx", GX)):
        ET.register_namespace(prefix, space)
    root = ET.Element(f"{{{KML}}}kml")
    document = _sub(root, "Document")
    _sub(document, "name", data.name)
    for index, colour in enumerate(LINE_COLOURS):
        style = _sub(_sub(document, "Style", id=f"uav-{index}"), "LineStyle")
        _sub(style, "color", colour)
        _sub(style, "width", "3")
    _fixed(document, data)
    _moving(document, data, users=users)
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def uav_ways(data: ReportData) -> tuple[Way, ...]:
    """In the order of the mission's UAVs."""
    count = len(data.records[0].uavs)
    return tuple(
        _way(data, str(data.records[0].uavs[i].system_id), [r.uavs[i] for r in data.records]) for i in range(count)
    )


def user_ways(data: ReportData) -> tuple[Way, ...]:
    """Of everyone in the last record; moments without a known place are left out."""
    last = data.records[-1].users
    of = {user.user_id: [] for user in last}  # type: dict[str, list[Any]]
    for record in data.records:
        here = {user.user_id: user for user in record.users}
        for user_id, places in of.items():
            places.append(here.get(user_id))
    return tuple(_way(data, user_id, places) for user_id, places in of.items())


def _way(data: ReportData, name: str, places: Sequence[Any]) -> Way:
    begun_s = data.records[0].time_s
    known = [
        (_lon_lat(data, place.east_m, place.north_m), record.slot, record.time_s - begun_s)
        for record, place in zip(data.records, places, strict=True)
        if place is not None and math.isfinite(place.east_m) and math.isfinite(place.north_m)
    ]
    positions, slots, times_s = zip(*known, strict=True) if known else ((), (), ())
    return Way(name, positions, slots, times_s)


def _lon_lat(data: ReportData, east_m: float, north_m: float) -> Position:
    lat_deg, lon_deg = data.scenario.area.frame.to_geodetic_deg(east_m, north_m)
    return round(float(lon_deg), DECIMALS), round(float(lat_deg), DECIMALS)


def _ring(data: ReportData, corners_m: Sequence[tuple[float, float]]) -> list[Position]:
    """Closed, counter-clockwise (RFC 7946, 3.1.6)."""
    east_north = list(corners_m)
    doubled_area = sum(
        a[0] * b[1] - b[0] * a[1] for a, b in zip(east_north, east_north[1:] + east_north[:1], strict=True)
    )
    ordered = east_north if doubled_area > 0.0 else east_north[::-1]
    ring = [_lon_lat(data, *corner) for corner in ordered]
    return [*ring, ring[0]]


def _area_corners(data: ReportData) -> list[tuple[float, float]]:
    width_m, depth_m = data.scenario.area.size_m
    return [(0.0, 0.0), (width_m, 0.0), (width_m, depth_m), (0.0, depth_m)]


def _feature(geometry: dict[str, Any] | None, **properties: Any) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _polygon(ring: list[Position]) -> dict[str, Any]:
    return {"type": "Polygon", "coordinates": [ring]}


def _line(way: Way) -> dict[str, Any] | None:
    """A line wants two positions (RFC 7946, 3.1.4); a null geometry is one without a place (3.2)."""
    if not way.positions:
        return None
    if len(way.positions) == 1:
        return {"type": "Point", "coordinates": way.positions[0]}
    return {"type": "LineString", "coordinates": list(way.positions)}


def _area(data: ReportData) -> dict[str, Any]:
    return _feature(_polygon(_ring(data, _area_corners(data))), kind="area", name=data.name)


def _obstacles(data: ReportData) -> list[dict[str, Any]]:
    return [
        _feature(_polygon(_ring(data, o.polygon_m)), kind="obstacle", name=o.name, height_m=o.height_m)
        for o in data.scenario.area.obstacles
    ]


def _uavs(data: ReportData) -> list[dict[str, Any]]:
    return [
        _feature(
            _line(way),
            kind="uav",
            system_id=total.system_id,
            alt_home_m=_alt_home_m(data, index),
            slots=list(way.slots),
            times_s=list(way.times_s),
            distance_m=total.distance_m,
            energy_j=total.energy_j,
            energy_share=total.energy_share,
        )
        for index, (way, total) in enumerate(zip(uav_ways(data), uav_totals(data), strict=True))
    ]


def _users(data: ReportData) -> list[dict[str, Any]]:
    totals: dict[str, UserTotal] = {total.user_id: total for total in user_totals(data)}
    return [_feature(_line(way), kind="user", id=way.name, **_facts(totals.get(way.name))) for way in user_ways(data)]


def _facts(total: UserTotal | None) -> dict[str, Any]:
    """Nothing before the first slot was flown."""
    if total is None:
        return {}
    return {
        "mean_aoi_slots": total.mean_aoi_slots,
        "max_aoi_slots": total.max_aoi_slots,
        "served_share": total.served_share,
        "waiting_mb": total.waiting_mb,
    }


def _alt_home_m(data: ReportData, index: int) -> float:
    return float(data.scenario.altitude_m - index * data.scenario.layer_m)


def _fixed(document: ET.Element, data: ReportData) -> None:
    area = _placemark(document, f"area of {data.name}")
    ring = [(lon, lat, 0.0) for lon, lat in _ring(data, _area_corners(data))]
    line = _sub(area, "LineString")
    _sub(line, "tessellate", "1")
    _sub(line, "coordinates", _coordinates(ring))
    for obstacle in data.scenario.area.obstacles:
        polygon = _sub(_placemark(document, obstacle.name), "Polygon")
        _sub(polygon, "extrude", "1")
        _sub(polygon, "altitudeMode", "relativeToGround")
        shell = _sub(_sub(polygon, "outerBoundaryIs"), "LinearRing")
        corners = [(lon, lat, obstacle.height_m) for lon, lat in _ring(data, obstacle.polygon_m)]
        _sub(shell, "coordinates", _coordinates(corners))


def _moving(document: ET.Element, data: ReportData, *, users: bool) -> None:
    folder = _folder(document, "UAVs")
    for index, way in enumerate(uav_ways(data)):
        _track(folder, data, way, f"UAV {way.name}", _alt_home_m(data, index), f"#uav-{index % len(LINE_COLOURS)}")
    if not users:
        return
    folder = _folder(document, "users")
    for way in user_ways(data):
        if way.positions:
            _track(folder, data, way, way.name, data.scenario.radio.user_height_m, None)


def _track(folder: ET.Element, data: ReportData, way: Way, name: str, height_m: float, style: str | None) -> None:
    placemark = _placemark(folder, name)
    if style is not None:
        _sub(placemark, "styleUrl", style)
    track = ET.SubElement(placemark, f"{{{GX}}}Track")
    _sub(track, "altitudeMode", "relativeToGround")
    for moment in _moments(data, way):
        _sub(track, "when", moment)
    for lon, lat in way.positions:
        ET.SubElement(track, f"{{{GX}}}coord").text = f"{lon:.7f} {lat:.7f} {height_m:.1f}"


def _moments(data: ReportData, way: Way) -> Iterator[str]:
    """xsd:dateTime; campaigns of which nobody knows the date begin with the Unix epoch."""
    try:
        begun = datetime.fromisoformat(data.provenance.begun_utc)
    except ValueError:
        begun = datetime.fromtimestamp(0.0, UTC)
    begun = begun.replace(tzinfo=UTC) if begun.tzinfo is None else begun.astimezone(UTC)
    for time_s in way.times_s:
        yield (begun + timedelta(seconds=time_s)).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _coordinates(corners: Sequence[tuple[float, float, float]]) -> str:
    return " ".join(f"{lon:.7f},{lat:.7f},{height_m:.1f}" for lon, lat, height_m in corners)


def _placemark(parent: ET.Element, name: str) -> ET.Element:
    placemark = _sub(parent, "Placemark")
    _sub(placemark, "name", name)
    return placemark


def _folder(parent: ET.Element, name: str) -> ET.Element:
    folder = _sub(parent, "Folder")
    _sub(folder, "name", name)
    return folder


def _sub(parent: ET.Element, tag: str, text: str | None = None, **attributes: str) -> ET.Element:
    """A KML child. Characters that XML 1.0 cannot carry are left out of its text."""
    child = ET.SubElement(parent, f"{{{KML}}}{tag}", attributes)
    if text is not None:
        child.text = "".join(c for c in text if c in "\t\n" or ord(c) >= 0x20)
    return child
