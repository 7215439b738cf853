"""Mission, fence and rally transfer, and the flight through a mission."""

from __future__ import annotations

from typing import Any

import pytest
from mock_station import ARM, MODE, Station, mav, station

RELATIVE = mav.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT


def item(seq: int, command: int, lat: int = 0, lon: int = 0, alt_m: float = 0.0, kind: int = 0) -> Any:
    return mav.MAVLink_mission_item_int_message(1, 1, seq, RELATIVE, command, 0, 1, 0, 0, 0, 0, lat, lon, alt_m, kind)


def upload(ground: Station, items: list[Any], kind: int = 0) -> int:
    """Answers the vehicle's requests as a ground station does; returns the result of the acknowledgement."""
    ground.send(mav.MAVLink_mission_count_message(1, 1, len(items), kind))
    for _ in range(20 * len(items) + 20):
        for message in ground.run(0.05):
            if message.get_type() == "MISSION_REQUEST_INT":
                assert message.mission_type == kind
                ground.send(items[message.seq])
            if message.get_type() == "MISSION_ACK":
                return int(message.type)
    raise AssertionError("no MISSION_ACK")


def survey(ground: Station) -> list[Any]:
    lat, lon = round(ground.vehicle.body.pad.lat_deg * 1e7), round(ground.vehicle.body.pad.lon_deg * 1e7)
    first = [item(0, 16, lat, lon)] if ground.vehicle.flavour.name == "ardupilot" else []
    steps = [
        (22, lat, lon, 20.0),
        (16, lat + 9000, lon, 25.0),
        (16, lat + 9000, lon + 9000, 25.0),
        (20, 0, 0, 0.0),
    ]
    return first + [item(len(first) + n, *step) for n, step in enumerate(steps)]


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_what_is_uploaded_is_downloaded(kind: int) -> None:
    ground = station("ardupilot")
    command = {0: 16, 1: 5001, 2: 5100}[kind]
    items = [item(n, command, 404258000 + n, -869197000 - n, 20.0 + n, kind) for n in range(5)]
    assert upload(ground, items, kind) == 0
    ground.send(mav.MAVLink_mission_request_list_message(1, 1, kind))
    ground.run(0.1)
    assert ground.last("MISSION_COUNT").count == 5
    for n in range(5):
        ground.send(mav.MAVLink_mission_request_int_message(1, 1, n, kind))
        ground.run(0.1)
        got = ground.last("MISSION_ITEM_INT")
        assert (got.seq, got.command, got.x, got.y, got.z) == (
            n,
            command,
            404258000 + n,
            -869197000 - n,
            20.0 + n,
        )
    ground.send(mav.MAVLink_mission_clear_all_message(1, 1, kind))
    ground.send(mav.MAVLink_mission_request_list_message(1, 1, kind))
    ground.run(0.1)
    assert ground.last("MISSION_COUNT").count == 0


def test_lost_items_are_asked_for_again_then_given_up() -> None:
    ground = station("px4")
    ground.send(mav.MAVLink_mission_count_message(1, 1, 3, 0))
    heard = [m for m in ground.run(3.0) if m.get_type().startswith("MISSION_")]
    assert [m.seq for m in heard[:-1]] == [0] * 6  # once and five times again, 250 ms apart
    assert heard[-1].get_type() == "MISSION_ACK"
    assert heard[-1].type == mav.MAV_MISSION_OPERATION_CANCELLED


def test_places_off_the_globe_are_refused() -> None:
    ground = station("px4")
    assert upload(ground, [item(0, 16, 2_000_000_000, 0, 10.0)]) == mav.MAV_MISSION_INVALID_PARAM5_X


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_mission_is_flown_to_its_end(flavour: str) -> None:
    ground = station(flavour)
    ground.run(2.5)
    items = survey(ground)
    assert upload(ground, items) == 0
    if flavour == "ardupilot":
        ground.command(MODE, 1, 4)
    assert ground.command(ARM, 1) == 0
    assert ground.command(300) == 0
    ground.run_until(lambda: ground.vehicle.flying, 10.0)
    farthest = 0.0

    def note() -> None:
        nonlocal farthest
        farthest = max(farthest, ground.vehicle.body.pos_ned_m[0])

    for _ in range(300):
        ground.run(1.0, every_s=1.0, do=note)
        if not ground.vehicle.armed:
            break
    assert not ground.vehicle.armed
    assert farthest == pytest.approx(100.0, abs=3.0)  # 9000e-7 degrees
    assert ground.vehicle.body.pos_ned_m == pytest.approx((0.0, 0.0, 0.0), abs=0.6)
    reached = [m.seq for m in ground.heard if m.get_type() == "MISSION_ITEM_REACHED"]
    assert reached == [len(items) - 4, len(items) - 3, len(items) - 2]


def test_no_mission_no_mission_mode() -> None:
    ground = station("ardupilot")
    ground.run(2.5)
    assert ground.command(MODE, 1, 3) == 4
