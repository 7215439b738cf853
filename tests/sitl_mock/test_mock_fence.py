"""Geofences: limits from parameters, uploaded zones, and what follows a breach in each flavour."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mock_station import Station, fly, mav, station

from sitl_mock.autopilot.fence import Zone

# Corners around the pad, metres north and east; degrees follow at the pad's latitude.
SQUARE = ((-50.0, -50.0), (-50.0, 50.0), (50.0, 50.0), (50.0, -50.0))
NORTH_DEG, EAST_DEG = 1 / 111_050.0, 1 / 84_900.0


def _upload(ground: Station, items: list[tuple[int, float, float, float]]) -> None:
    """Fence items: command, param1, metres north, metres east."""
    ground.send(mav.MAVLink_mission_count_message(1, 1, len(items), 1))
    for seq, (command, param, north, east) in enumerate(items):
        ground.run(0.1)
        x, y = round((40.4258 + north * NORTH_DEG) * 1e7), round((-86.9197 + east * EAST_DEG) * 1e7)
        ground.send(
            mav.MAVLink_mission_item_int_message(1, 1, seq, 0, command, 0, 1, param, 0, 0, 0, x, y, 0, mission_type=1)
        )
    ground.run(0.1)
    assert ground.last("MISSION_ACK").type == 0


def _north(ground: Station, seconds: float) -> None:
    ground.run(seconds, every_s=0.1, do=lambda: ground.velocity(8, 0))


@pytest.mark.parametrize(("action", "mode"), [(0, "GUIDED"), (1, "RTL"), (2, "LAND"), (4, "BRAKE")])
def test_ardupilot_circle(action: int, mode: str) -> None:
    ground = station("ardupilot")
    for name, value in {"FENCE_ENABLE": 1, "FENCE_RADIUS": 40, "FENCE_ACTION": action}.items():
        ground.vehicle.params.set(name, value)
    fly(ground)
    _north(ground, 4.0)
    assert ground.vehicle.mode.name == "GUIDED"
    _north(ground, 4.0)
    assert ground.vehicle.mode.name == mode
    assert "Fence Breached" in ground.texts()
    ground.command(512, 162)
    assert ground.last("FENCE_STATUS").breach_count == 1


def test_ardupilot_height() -> None:
    ground = station("ardupilot")
    ground.command(207, 1)
    ground.vehicle.params.set("FENCE_ALT_MAX", 40)
    fly(ground)
    ground.run(8.0, every_s=0.1, do=lambda: ground.velocity(0, 0, -3))
    assert ground.vehicle.mode.name == "RTL"


def test_fence_off_is_off() -> None:
    ground = station("ardupilot")
    ground.vehicle.params.set("FENCE_RADIUS", 10)
    fly(ground)
    _north(ground, 8.0)
    assert ground.vehicle.mode.name == "GUIDED"


@pytest.mark.parametrize(("flavour", "mode"), [("ardupilot", "RTL"), ("px4", "AUTO.RTL")])
def test_uploaded_polygon(flavour: str, mode: str) -> None:
    ground = station(flavour)
    if flavour == "ardupilot":
        ground.vehicle.params.set("FENCE_ENABLE", 1)
    else:
        ground.vehicle.params.set("GF_ACTION", 3)
    _upload(ground, [(5001, 4, *corner) for corner in SQUARE])
    fly(ground)
    if flavour == "px4":
        ground.run(1.5, every_s=0.1, do=lambda: ground.velocity(8, 0))
        assert ground.command(176, 1, 6) == 0
    _north(ground, 4.0)
    assert "RTL" not in ground.vehicle.mode.name
    _north(ground, 6.0)
    assert ground.vehicle.mode.name == mode


def test_px4_stay_out_circle_terminates_if_told() -> None:
    ground = station("px4")
    ground.vehicle.params.set("GF_ACTION", 4)
    _upload(ground, [(5004, 15.0, 0.0, 0.0)])
    ground.run(2.5)
    assert ground.command(400, 1) == 0
    ground.command(22, 0, 0, 0, 0, 0, 0, 196.0)
    ground.run(4.0)
    assert not ground.vehicle.armed
    assert any("violation" in text for text in ground.texts())


@given(st.floats(-100, 100), st.floats(-100, 100))
def test_zones_allow_one_side(north: float, east: float) -> None:
    inside = abs(north) < 50.0 and abs(east) < 50.0
    if min(abs(abs(north) - 50.0), abs(abs(east) - 50.0)) > 1e-6:
        assert Zone(SQUARE, 0.0, True).allows(north, east) == inside
        assert Zone(SQUARE, 0.0, False).allows(north, east) != inside
