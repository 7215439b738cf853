"""Tracks against strangers: PROJ's geodesic lengths, the RFC's rules, an XML parser."""

import json
import math
from dataclasses import replace
from itertools import pairwise
from xml.etree import ElementTree as ET

import pytest
from pyproj import Geod

from gcs.report import Provenance, ReportData
from gcs.report.tracks import GX, KML, geojson, kml

WGS84 = Geod(ellps="WGS84")
NAMES = {"k": KML, "gx": GX}


def features(data: ReportData, kind: str, **options) -> list[dict]:
    document = json.loads(json.dumps(geojson(data, **options), allow_nan=False))
    assert document["type"] == "FeatureCollection"
    return [f for f in document["features"] if f["properties"]["kind"] == kind]


def test_a_uavs_line_is_as_long_as_its_way(report: ReportData):
    for index, feature in enumerate(features(report, "uav")):
        line = feature["geometry"]["coordinates"]
        longitudes, latitudes = zip(*line, strict=True)
        flown = [record.uavs[index] for record in report.records]
        ours_m = sum(math.dist((a.east_m, a.north_m), (b.east_m, b.north_m)) for a, b in pairwise(flown))
        assert WGS84.line_length(longitudes, latitudes) == pytest.approx(ours_m, rel=1e-3)
        assert feature["properties"]["distance_m"] == pytest.approx(ours_m)
        assert feature["properties"]["slots"] == [record.slot for record in report.records]
        assert feature["properties"]["times_s"][1] == report.scenario.slot_s


def test_east_and_north_are_not_swapped(report: ReportData):
    (lon, lat), *_ = features(report, "area")[0]["geometry"]["coordinates"][0]
    start = features(report, "uav")[0]["geometry"]["coordinates"][0]
    azimuth_deg, _, distance_m = WGS84.inv(lon, lat, *start)
    assert azimuth_deg == pytest.approx(math.degrees(math.atan2(800.0, 600.0)), abs=0.1)
    assert distance_m == pytest.approx(1000.0, rel=1e-3)


def test_rings_are_closed_and_run_counter_clockwise(report: ReportData):
    shapes = features(report, "area") + features(report, "obstacle")
    assert len(shapes) == 3
    for shape in shapes:
        ring = shape["geometry"]["coordinates"][0]
        assert ring[0] == ring[-1]
        area_m2, _ = WGS84.polygon_area_perimeter(*zip(*ring, strict=True))
        assert area_m2 > 0.0, "RFC 7946, 3.1.6"


def test_users_carry_how_they_fared_and_can_be_left_out(report: ReportData):
    users = features(report, "user")
    assert len(users) == len(report.records[0].users)
    assert users[0]["properties"]["mean_aoi_slots"] >= 1.0
    assert features(report, "user", users=False) == []
    assert ">u0<" in kml(report)
    assert ">u0<" not in kml(report, users=False)


def test_a_place_that_nobody_knows_is_left_out(report: ReportData):
    lost = tuple(replace(user, east_m=math.nan, north_m=math.nan) for user in report.records[0].users)
    records = (replace(report.records[0], users=lost), *report.records[1:2])
    users = features(replace(report, records=records), "user")
    assert {user["geometry"]["type"] for user in users} == {"Point"}
    nowhere = features(replace(report, records=records[:1]), "user")
    assert {user["geometry"] for user in nowhere} == {None}


def test_kml_has_a_moment_for_each_place(report: ReportData):
    root = ET.fromstring(kml(report))
    tracks = root.findall(".//gx:Track", NAMES)
    assert len(tracks) == 2 + len(report.records[0].users)
    whens = [when.text for when in tracks[0].findall("k:when", NAMES)]
    places = [coord.text.split() for coord in tracks[0].findall("gx:coord", NAMES)]
    assert len(whens) == len(places) == len(report.records)
    assert whens[:2] == ["2026-01-02T03:04:05.000Z", "2026-01-02T03:04:20.000Z"]
    assert [float(place[2]) for place in places[:1]] == [120.0]
    assert [float(t.find("gx:coord", NAMES).text.split()[2]) for t in tracks[1:2]] == [115.0]
    assert [float(v) for v in places[-1][:2]] == features(report, "uav")[0]["geometry"]["coordinates"][-1]


def test_words_from_outside_cannot_break_the_xml(report: ReportData):
    root = ET.fromstring(kml(replace(report, name="a\x00<b>&", provenance=Provenance(begun_utc="nonsense"))))
    assert root.find("k:Document/k:name", NAMES).text == "a<b>&"
    assert root.find(".//k:when", NAMES).text == "1970-01-01T00:00:00.000Z"
