"""The mock's geodesy against PROJ and its own inverse."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyproj import Geod

from sitl_mock.geodesy import Geodetic, to_geodetic, to_ned_m

_offset = st.floats(-5000, 5000)


@given(st.floats(-70, 70), st.floats(-170, 170), _offset, _offset, st.floats(-100, 500))
def test_there_and_back(lat_deg: float, lon_deg: float, north_m: float, east_m: float, up_m: float) -> None:
    origin = Geodetic(lat_deg, lon_deg, 100.0)
    back = to_ned_m(origin, to_geodetic(origin, north_m, east_m, up_m))
    assert back == pytest.approx((north_m, east_m, -up_m), abs=1e-5)


@pytest.mark.parametrize(("north_m", "east_m"), [(1222.0, 1667.0), (-900.0, 300.0), (0.0, -2000.0)])
def test_distance_agrees_with_proj(north_m: float, east_m: float) -> None:
    origin = Geodetic(40.4203, -86.93, 0.0)
    there = to_geodetic(origin, north_m, east_m, 0.0)
    _, _, distance_m = Geod(ellps="WGS84").inv(origin.lon_deg, origin.lat_deg, there.lon_deg, there.lat_deg)
    assert distance_m == pytest.approx((north_m**2 + east_m**2) ** 0.5, abs=0.05)
