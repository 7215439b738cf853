import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcs.report import ReportData
from gcs.report.aoi_scale import AOI_STEPS, aoi_step
from gcs.report.map_view import map_view, scale_bar_m


def test_north_is_up_and_one_unit_is_a_metre(report: ReportData):
    view = map_view(report)
    last = report.records[-1].uavs[0]
    assert view.tracks[0].end == (round(last.east_m, 1), round(1200.0 - last.north_m, 1))
    assert view.tracks[0].start == (800.0, 600.0)
    assert view.serving_radius_m == pytest.approx(226.0, abs=1.0)


def test_a_track_is_whole_and_its_pieces_join(report: ReportData):
    pieces = map_view(report).tracks[0].pieces
    ends = [piece.points.split() for piece in pieces]
    assert all(before[-1] == after[0] for before, after in pairwise(ends))
    assert sum(len(points) - 1 for points in ends) == len(report.records) - 1
    assert [piece.opacity for piece in pieces] == sorted(piece.opacity for piece in pieces)


def test_only_obstacles_that_reach_the_uavs_block(report: ReportData):
    assert {shape.name: shape.blocks for shape in map_view(report).obstacles} == {"tower <b>": True, "shed": False}


def test_the_oldest_users_lie_on_top(report: ReportData):
    steps = [mark.step for mark in map_view(report).users]
    assert steps == sorted(steps)


def test_a_campaign_without_flown_slots_has_places_and_no_way(report: ReportData):
    track = map_view(replace(report, records=report.records[:1])).tracks[0]
    assert track.pieces == ()
    assert track.start == track.end


@given(st.floats(10.0, 1e6))
def test_the_scale_bar_is_round_and_between_a_tenth_and_a_quarter_of_the_map(width_m: float):
    bar_m = scale_bar_m(width_m)
    assert width_m / 10.0 - 1e-9 <= bar_m <= width_m / 4.0
    assert str(bar_m / 10.0 ** math.floor(math.log10(bar_m) + 1e-9))[0] in "125"


@given(st.floats(1.0, 1e6), st.floats(0.0, 1e6))
def test_older_is_never_a_lower_step(aoi_slots: float, more: float):
    assert 0 <= aoi_step(aoi_slots) <= aoi_step(aoi_slots + more) < len(AOI_STEPS)


def test_fresh_users_have_the_quiet_step():
    assert aoi_step(1.0) == 0
    assert [aoi_step(value) for value in (2.0, 4.9, 5.0, 9.9, 10.0, 19.0, 20.0)] == [1, 1, 2, 2, 3, 3, 4]
