"""Geometry by hand; the local frame against PROJ."""

import math

import numpy as np
import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policy.world.frames import LocalFrame, heading_rad, velocity_enu_mps
from policy.world.geometry import distance_to_polygon_m, inside_polygon, inside_rectangle, polygon_area_m2

SQUARE = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0))
NOTCHED = ((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (5.0, 5.0), (0.0, 10.0))


def test_inside_by_hand() -> None:
    points = np.asarray([[5.0, 2.0], [5.0, 7.0], [11.0, 5.0], [1.0, 8.0]])
    assert inside_polygon(points, NOTCHED).tolist() == [True, False, False, True]
    assert inside_rectangle(points, (10.0, 10.0), 1.5).tolist() == [True, True, False, False]


def test_distance_by_hand() -> None:
    points = np.asarray([[5.0, 5.0], [13.0, 14.0], [5.0, -2.0]])
    assert distance_to_polygon_m(points, SQUARE) == pytest.approx([0.0, 5.0, 2.0])


def test_area_by_hand() -> None:
    assert polygon_area_m2(SQUARE) == 100.0
    assert polygon_area_m2(NOTCHED[::-1]) == 75.0


@given(st.floats(0.0, 2 * math.pi, exclude_max=True), st.floats(0.1, 20.0))
def test_heading_and_velocity_are_inverse(heading: float, speed: float) -> None:
    velocity = velocity_enu_mps(np.asarray(heading), np.asarray(speed))
    back = float(heading_rad(velocity))
    assert 0.0 <= back < 2 * math.pi
    assert math.cos(back - heading) == pytest.approx(1.0)


def test_headings_by_hand() -> None:
    assert heading_rad(np.asarray([1.0, 0.0])) == pytest.approx(math.pi / 2)  # east
    assert heading_rad(np.asarray([0.0, -1.0])) == pytest.approx(math.pi)  # south
    assert heading_rad(np.asarray([0.0, 0.0])) == 0.0


@pytest.mark.parametrize("origin", [(40.4203, -86.93), (36.3597, 127.3475), (-33.9, 18.4), (60.0, 25.0)])
def test_frame_against_proj(origin: tuple[float, float]) -> None:
    geod = pyproj.Geod(ellps="WGS84")
    frame = LocalFrame(*origin)
    for bearing in range(0, 360, 45):
        lon, lat, _ = geod.fwd(origin[1], origin[0], bearing, 2000.0)
        east, north = frame.to_enu_m(np.asarray(lat), np.asarray(lon))
        expected = (2000.0 * math.sin(math.radians(bearing)), 2000.0 * math.cos(math.radians(bearing)))
        assert (float(east), float(north)) == pytest.approx(expected, abs=1.2)
        back = frame.to_geodetic_deg(east, north)
        assert (float(back[0]), float(back[1])) == pytest.approx((lat, lon), abs=1e-9)
