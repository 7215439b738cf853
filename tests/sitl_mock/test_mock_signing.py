"""Signing against pymavlink's own, which knows nothing of ours (https://mavlink.io/en/guide/message_signing.html)."""

from __future__ import annotations

import io
from hashlib import sha256

import pytest
from mock_station import MODE, Station, mav, station

from sitl_mock.autopilot.telemetry import EPOCH_S
from sitl_mock.wire.signing import Signer, timestamp_units

KEY = bytes(range(1, 33))
NOW = timestamp_units(EPOCH_S)
MINUTE = 60 * 100_000


def _sign(ground: Station, timestamp: int = NOW, key: bytes = KEY, link: int = 5) -> None:
    """The station signs what it sends, and takes only what is signed."""
    for codec, signs in ((ground.mav, True), (ground._decoder, False)):
        codec.signing.secret_key, codec.signing.link_id, codec.signing.timestamp = key, link, timestamp
        codec.signing.sign_outgoing = signs


def _setup(ground: Station, key: bytes = KEY, timestamp: int = NOW) -> None:
    ground.send(mav.MAVLink_setup_signing_message(1, 1, list(key), timestamp))
    ground.run(0.1)


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_once_set_up_only_signed_commands_are_obeyed(flavour: str) -> None:
    ground = station(flavour)
    ground.run(2.5)
    _setup(ground)
    assert ground.command(MODE, 1, 4) is None
    assert ground.vehicle.signer.refused > 0
    _sign(ground)
    assert ground.command(512, 148) == 0
    assert ground._decoder.signing.badsig_count == 0
    assert ground._decoder.signing.sig_count > 0


def test_a_wrong_key_is_refused() -> None:
    ground = station("ardupilot", key=KEY)
    _sign(ground, key=bytes(32 * [7]))
    assert ground.command(MODE, 1, 4) is None
    assert ground.vehicle.mode.name == "STABILIZE"


def test_a_repeated_frame_is_refused() -> None:
    ground = station("ardupilot", key=KEY)
    _sign(ground)
    ping = bytes(mav.MAVLink_ping_message(5, 6, 0, 0).pack(ground.mav))
    answers = []
    for _ in range(2):
        ground.simulation.receive(0, 1, ping)
        answers.append([message for message in ground.run(0.1) if message.get_type() == "PING"])
    assert [len(answer) for answer in answers] == [1, 0]


@pytest.mark.parametrize(("behind", "taken"), [(MINUTE - 500, True), (MINUTE + 100_000, False), (-9 * MINUTE, True)])
def test_a_new_stream_may_be_a_minute_behind(behind: int, taken: bool) -> None:
    ground = station("ardupilot", key=KEY)
    _sign(ground, NOW - behind)
    assert (ground.command(MODE, 1, 4) == 0) == taken


def test_unsigned_again_by_a_signed_zero_key() -> None:
    ground = station("ardupilot", key=KEY)
    _setup(ground, bytes(32), 0)
    assert ground.vehicle.signer.active  # it was not signed
    _sign(ground)
    _setup(ground, bytes(32), 0)
    assert not ground.vehicle.signer.active


def test_px4_takes_heartbeats_unsigned() -> None:
    for flavour, heard in (("px4", True), ("ardupilot", False)):
        ground = station(flavour, key=KEY)
        ground.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
        assert (ground.vehicle.link_heard_s is not None) == heard


def test_signature_by_hand() -> None:
    frame = b"\xfd some frame"
    signer = Signer(KEY, link_id=3)
    signer.tell_time(EPOCH_S)
    signed = signer.sign(frame)
    tail = bytes([3]) + (NOW + 1).to_bytes(6, "little")
    assert signed == frame + tail + sha256(KEY + frame + tail).digest()[:6]


def test_too_many_streams_are_refused() -> None:
    signer, sender = Signer(KEY), mav.MAVLink(io.BytesIO(), srcSystem=9)
    sender.signing.secret_key, sender.signing.sign_outgoing, sender.signing.timestamp = KEY, True, NOW
    taken = []
    for link in range(20):
        sender.signing.link_id = link
        raw = bytes(mav.MAVLink_ping_message(5, link, 0, 0).pack(sender))
        taken.append(signer.accepts(raw, 9, 0, signed=True))
    assert taken == [True] * 16 + [False] * 4
