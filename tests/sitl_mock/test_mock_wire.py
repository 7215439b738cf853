"""The mock's codec against pymavlink, golden bytes and rubbish."""

from __future__ import annotations

import io
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v10 import ardupilotmega as v1
from pymavlink.dialects.v20 import ardupilotmega as v2

from sitl_mock.wire import Frame, Parser, encode
from sitl_mock.wire.checksum import x25
from sitl_mock.wire.definition import BY_ID, BY_NAME, Definition

_RANGE = {
    "B": (0, 2**8 - 1),
    "b": (-(2**7), 2**7 - 1),
    "H": (0, 2**16 - 1),
    "h": (-(2**15), 2**15 - 1),
    "I": (0, 2**32 - 1),
    "i": (-(2**31), 2**31 - 1),
    "Q": (0, 2**64 - 1),
    "q": (-(2**63), 2**63 - 1),
}


# pymavlink's dialects leave these out; the figures are those of the C headers (MAVLINK_MSG_ID_EVENT_CRC ...).
_EVENTS = {"EVENT": 160, "CURRENT_EVENT_SEQUENCE": 106, "REQUEST_EVENT": 33, "RESPONSE_EVENT_ERROR": 77}
_SHARED = [definition for definition in BY_ID.values() if definition.name not in _EVENTS]


def _stranger(name: str) -> Any:
    return getattr(v2, f"MAVLink_{name.lower()}_message")


def _value(code: str) -> st.SearchStrategy[Any]:
    if code == "f":
        return st.floats(width=32, allow_nan=False, allow_infinity=False)
    low, high = _RANGE[code]
    return st.integers(low, high)


@st.composite
def _values(draw: st.DrawFn, definition: Definition) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for part in definition.fields:
        if part.code == "s":
            text = st.text(st.characters(min_codepoint=32, max_codepoint=126), max_size=part.length)
            values[part.name] = draw(text)
        elif part.length:
            values[part.name] = tuple(draw(_value(part.code)) for _ in range(part.length))
        else:
            values[part.name] = draw(_value(part.code))
    return values


def _as_stranger(definition: Definition, values: dict[str, Any]) -> Any:
    def adapt(name: str) -> Any:
        value = values[name]
        return value.encode() if isinstance(value, str) else list(value) if isinstance(value, tuple) else value

    kind = _stranger(definition.name)
    return kind(**{name: adapt(name) for name in kind.fieldnames})


def test_checksum_gives_the_catalogued_value() -> None:
    assert x25(b"123456789") == 0x6F91  # CRC-16/MCRF4XX check value, reveng catalogue


@pytest.mark.parametrize("definition", _SHARED, ids=lambda definition: definition.name)
def test_every_definition_agrees_with_pymavlink(definition: Definition) -> None:
    kind = _stranger(definition.name)
    assert (kind.id, kind.crc_extra) == (definition.msg_id, definition.crc_extra)
    assert [part.name for part in definition.fields] == kind.ordered_fieldnames
    assert definition.layout.format.replace("s", "").lstrip("<")
    assert definition.layout.size == kind.unpacker.size


@pytest.mark.parametrize("definition", _SHARED, ids=lambda definition: definition.name)
@settings(max_examples=6, deadline=None)
@given(data=st.data())
def test_both_directions_against_pymavlink(definition: Definition, data: st.DataObject) -> None:
    values = data.draw(_values(definition))
    ours = encode(definition.name, values, system=7, component=1, seq=200)
    other = v2.MAVLink(io.BytesIO(), srcSystem=7, srcComponent=1)
    other.seq = 200
    theirs = _as_stranger(definition, values).pack(other)
    assert ours == bytes(theirs)
    (back,) = Parser().feed(bytes(theirs))
    assert (back.name, back.system, back.component, back.seq) == (definition.name, 7, 1, 200)
    assert dict(back.values) == values


@pytest.mark.parametrize(("name", "extra"), _EVENTS.items())
def test_event_definitions_have_the_published_crc(name: str, extra: int) -> None:
    assert BY_NAME[name].crc_extra == extra


def test_golden_heartbeat() -> None:
    values = {"type": 2, "autopilot": 12, "base_mode": 29, "custom_mode": 0x00050000, "system_status": 3}
    frame = encode("HEARTBEAT", {**values, "mavlink_version": 3}, system=1, component=1, seq=0)
    assert frame[:10] == bytes.fromhex("fd 09 00 00 00 01 01 00 00 00")
    assert frame[10:19] == bytes.fromhex("00 00 05 00 02 0c 1d 03 03")
    assert v2.MAVLink(io.BytesIO()).parse_buffer(bytearray(frame))[0].custom_mode == 0x00050000


def test_version_1_is_read() -> None:
    sender = v1.MAVLink(io.BytesIO(), srcSystem=255, srcComponent=190)
    raw = v1.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0).pack(sender)
    (frame,) = Parser().feed(bytes(raw))
    assert (frame.version, frame.name, frame["command"], frame["param1"]) == (1, "COMMAND_LONG", 400, 1.0)


def test_signed_frame_is_read_and_marked() -> None:
    sender = v2.MAVLink(io.BytesIO(), srcSystem=255, srcComponent=190)
    sender.signing.secret_key, sender.signing.link_id = bytes(range(32)), 1
    sender.signing.timestamp, sender.signing.sign_outgoing = 10**12, True
    raw = bytes(v2.MAVLink_ping_message(5, 6, 0, 0).pack(sender))
    (frame,) = Parser().feed(raw)
    assert frame.signed
    assert frame["seq"] == 6


def test_unknown_flag_is_not_guessed_at() -> None:
    raw = bytearray(encode("PING", {"seq": 1}, system=1, component=1, seq=0))
    raw[2] = 0x02
    assert Parser().feed(bytes(raw)) == []


@settings(max_examples=60, deadline=None)
@given(st.lists(st.binary(max_size=40), max_size=6), st.integers(1, 17))
def test_frames_are_found_in_rubbish_whatever_the_cuts(rubbish: list[bytes], cut: int) -> None:
    clean = bytes(byte for chunk in rubbish for byte in chunk if byte not in (0xFD, 0xFE))
    frames = b"".join(encode("PING", {"seq": n}, system=3, component=1, seq=n) for n in range(5))
    stream = clean + frames + clean + frames
    parser = Parser()
    got = [frame for at in range(0, len(stream), cut) for frame in parser.feed(stream[at : at + cut])]
    assert [frame["seq"] for frame in got] == [0, 1, 2, 3, 4] * 2


@settings(max_examples=150, deadline=None)
@given(st.lists(st.binary(max_size=600), max_size=8))
def test_no_bytes_crash_or_pile_up(chunks: list[bytes]) -> None:
    parser = Parser()
    for chunk in chunks:
        assert all(isinstance(frame, Frame) for frame in parser.feed(chunk))
    assert len(parser._buffer) <= 300 + max(map(len, chunks), default=0)


def test_names_and_ids_are_unique() -> None:
    assert len(BY_NAME) == len(BY_ID)
