"""Tracks: the area's metres, carried forward by a fix's age."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcs.fleet.track import is_link_lost, make_track
from gcs.ports import VehicleStatus
from policy.world.frames import LocalFrame

FRAME = LocalFrame(40.42, -86.93)


def status(east_m: float = 100.0, north_m: float = 200.0, **changes: object) -> VehicleStatus:
    lat_deg, lon_deg = FRAME.to_geodetic_deg(east_m, north_m)
    known = {
        "lat_deg": lat_deg,
        "lon_deg": lon_deg,
        "alt_home_m": 50.0,
        "position_s": 10.0,
        "vel_ned_mps": (4.0, 3.0, -1.0),
    }
    return VehicleStatus(1, **{**known, **changes})  # type: ignore[arg-type]


@given(east=st.floats(-3000, 3000), north=st.floats(-3000, 3000), age=st.floats(0, 30))
def test_carried_forward_half_a_second_at_most(east: float, north: float, age: float) -> None:
    track = make_track(status(east, north), FRAME, 10.0 + age)
    assert track is not None
    ahead = min(age, 0.5)
    assert (track.east_m, track.north_m) == pytest.approx((east + 3.0 * ahead, north + 4.0 * ahead), abs=1e-5)
    assert track.alt_home_m == pytest.approx(50.0 + ahead)
    assert track.is_stale == (track.age_s > 1.0)


@pytest.mark.parametrize("missing", ["lat_deg", "lon_deg", "alt_home_m", "position_s"])
def test_no_track_before_a_whole_position(missing: str) -> None:
    assert make_track(status(**{missing: None}), FRAME, 10.0) is None


def test_a_position_that_is_no_number_is_none() -> None:
    assert make_track(status(lat_deg=math.nan), FRAME, 10.0) is None


def test_speed_is_over_ground() -> None:
    track = make_track(status(), FRAME, 10.0)
    assert track is not None
    assert track.speed_mps == pytest.approx(5.0)


@pytest.mark.parametrize(("heard_s", "lost"), [(None, True), (4.9, True), (5.1, False)])
def test_link(heard_s: float | None, lost: bool) -> None:
    assert is_link_lost(VehicleStatus(1, heartbeat_s=heard_s), 10.0) is lost
