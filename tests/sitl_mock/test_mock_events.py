"""PX4's events: told in order, sent again to who missed one."""

from __future__ import annotations

from typing import Any

from mock_station import ARM, Station, station

from sitl_mock.autopilot.events import event_id
from sitl_mock.wire import Frame, Parser, encode


def _heard(ground: Station, seconds: float) -> list[Frame]:
    """pymavlink's dialects have no events: read with our own codec, whose definition test_mock_wire holds."""
    parser, frames = Parser(), []
    for datagram in ground.simulation.advance_to(ground.now_s + seconds):
        frames += parser.feed(datagram.data)
    return frames


def _ask(ground: Station, first: int, last: int) -> list[Any]:
    values = {"target_system": 1, "target_component": 1, "first_sequence": first, "last_sequence": last}
    frame = encode("REQUEST_EVENT", values, system=245, component=190, seq=0)
    ground.simulation.receive(0, 1, frame)
    return [(f.name, f["sequence"]) for f in _heard(ground, 0.1) if f.name in {"EVENT", "RESPONSE_EVENT_ERROR"}]


def test_id_is_the_hash_of_the_name_under_the_component() -> None:
    """FNV-1a of "a" is 0xE40C292C (the algorithm's published test vector)."""
    assert event_id("a") == 0x010C292C


def test_arming_tells_an_event_that_can_be_asked_for_again() -> None:
    ground = station("px4")
    ground.run(2.5)
    ground.command(ARM, 1)
    ground.command(ARM, 0)
    assert ground.vehicle.events.sequence == 2
    assert _ask(ground, 1, 2) == [("EVENT", 1), ("EVENT", 2)]
    assert _ask(ground, 2, 3) == [("EVENT", 2), ("RESPONSE_EVENT_ERROR", 3)]
    current = [f["sequence"] for f in _heard(ground, 6.0) if f.name == "CURRENT_EVENT_SEQUENCE"]
    assert set(current) == {2}


def test_ardupilot_has_no_events() -> None:
    ground = station("ardupilot")
    ground.run(2.5)
    ground.command(ARM, 1)
    assert ground.vehicle.events.sequence == 0
    assert _ask(ground, 1, 1) == []


def test_calibration_is_in_progress_then_done() -> None:
    ground = station("ardupilot")
    ground.run(2.5)
    assert ground.command(241, 1) == 5
    assert ground.command(241, 1) == 5  # asked again meanwhile
    acks = [message for message in ground.run(3.0) if message.get_type() == "COMMAND_ACK"]
    assert [(ack.command, ack.result) for ack in acks] == [(241, 0)]
