"""Frames are read as pymavlink's own parser reads them, whatever comes: good, cut short, broken, signed, rubbish."""

import math
import time
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v10 import ardupilotmega as v1
from pymavlink.dialects.v20 import ardupilotmega as v2

from gcs.links.frame_reader import FrameReader
from gcs.links.kinds import BY_NUMBER
from gcs.links.wire import Heard, Path

PATH = Path("udpin:0.0.0.0:14550", ("127.0.0.1", 9))
KEY = bytes(range(32))
UNKNOWN = 54_321


def codec(key: bytes | None = None) -> Any:
    made = v2.MAVLink(None, srcSystem=7, srcComponent=1)
    made.robust_parsing = True
    made.signing.secret_key = key
    made.signing.timestamp = round((time.time() - 1_420_070_400) * 1e5)
    return made


def by_pymavlink(chunks: list[bytes], key: bytes | None = None) -> list[tuple[Any, ...]]:
    """The reference: pymavlink's parser, which says BAD_DATA of what is broken."""
    parser = codec(key)
    found = [message for data in chunks for message in parser.parse_buffer(data) or ()]
    return [seen(PATH, m.get_type(), m.get_srcSystem(), m.get_srcComponent(), m.get_seq(), m)
            for m in found if m.get_type() != "BAD_DATA"]  # fmt: skip


def by_reader(chunks: list[bytes], key: bytes | None = None) -> list[tuple[Any, ...]]:
    reader = FrameReader(PATH, codec(key))
    return [seen(*heard) for data in chunks for heard in reader.feed(data)]


def seen(path: Path, name: str, system: int, component: int, sequence: int | None, body: Any) -> tuple[Any, ...]:
    """Comparable: NaN is as good as NaN; a kind that is not taken apart shows its header only."""
    kind = next((kind for kind in BY_NUMBER.values() if kind.name == name), None)
    fields = () if body is None or kind is None or not kind.is_read else tuple(getattr(body, n) for n in kind.fields)
    return name, system, component, sequence, tuple(map(_comparable, fields))


def _comparable(value: Any) -> Any:
    if isinstance(value, list):
        return [_comparable(one) for one in value]
    return "nan" if value != value else value


def frame_from(number: int, payload: bytes, flags: int = 0, sequence: int = 5) -> bytes:
    """A version 2 frame with a good checksum and any payload."""
    body = bytes((len(payload), flags, 0, sequence, 7, 1)) + number.to_bytes(3, "little") + payload
    extra = v2.mavlink_map[number].crc_extra if number in v2.mavlink_map else 0
    return b"\xfd" + body + v2.x25crc(body + bytes((extra,))).crc.to_bytes(2, "little")


def flipped(frame: bytes, at: int, bit: int) -> bytes:
    changed = bytearray(frame)
    changed[at] ^= 1 << bit
    return bytes(changed)


def heartbeat_v1(sequence: int) -> bytes:
    made = v1.MAVLink(None, srcSystem=9, srcComponent=2)
    made.seq = sequence
    return bytes(made.heartbeat_encode(2, 3, 81, 4, 4).pack(made))


numbers = st.sampled_from(sorted(v2.mavlink_map)) | st.sampled_from((0, 1, 24, 30, 33, 74, 77, 111, 147, 193, UNKNOWN))
payloads = st.binary(max_size=255)
good = st.builds(frame_from, numbers, payloads, st.just(0), st.integers(0, 255))
flagged = st.builds(frame_from, numbers, payloads, st.sampled_from((0, 2, 4, 128)), st.integers(0, 255))
broken = st.builds(lambda frame, at, bit: flipped(frame, at % len(frame), bit), good, st.integers(0), st.integers(0, 7))
cut_short = st.builds(lambda frame, share: frame[: int(share * len(frame))], good, st.floats(0.0, 1.0))
old = st.builds(heartbeat_v1, st.integers(0, 255))
rubbish = st.binary(max_size=30)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.lists(good | flagged | broken | cut_short | old | rubbish, max_size=12), st.lists(st.integers(1, 300)))
def test_any_stream_cut_anywhere_is_read_as_pymavlink_reads_it(parts: list[bytes], cuts: list[int]) -> None:
    stream, chunks, at = b"".join(parts), [], 0
    for cut in [*cuts, len(stream) + 1]:
        chunks.append(stream[at : at + cut])
        at += cut
    chunks.append(bytes(600))  # what waits for its end has it now
    assert by_reader(chunks) == by_pymavlink(chunks)


@pytest.mark.parametrize("number", sorted(v2.mavlink_map))
def test_every_kind_whole_without_its_trailing_zeros_and_longer(number: int) -> None:
    size = v2.mavlink_map[number].unpacker.size
    whole = bytes(1 + i % 100 for i in range(size))
    frames = [frame_from(number, payload) for payload in (whole, whole[: size // 2], whole[:1], (whole + b"xyz")[:255])]
    assert by_reader(frames) == by_pymavlink(frames)
    assert len(by_reader(frames)) == 4


@pytest.mark.parametrize("at", range(39))
def test_a_single_wrong_byte_anywhere_is_never_read(at: int) -> None:
    frame = bytes(codec().attitude_encode(1000, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6).pack(codec()))
    assert len(by_reader([frame])) == 1
    wrong = flipped(frame[:39], min(at, len(frame) - 1), 3)
    assert [name for name, *_ in by_reader([wrong, bytes(300)]) if name == "ATTITUDE"] == []


def test_fields_are_what_the_bytes_say() -> None:
    """By hand: little-endian, fields in the order of their size (the definition of GLOBAL_POSITION_INT)."""
    payload = b"".join(
        value.to_bytes(size, "little", signed=True)
        for value, size in ((120_000, 4), (404_203_000, 4), (-869_300_000, 4), (336_500, 4), (150_250, 4),
                            (-120, 2), (340, 2), (-5, 2), (9_000, 2))
    )  # fmt: skip
    (heard,) = FrameReader(PATH, codec()).feed(frame_from(33, payload))
    body = heard.body
    assert heard[:5] == (PATH, "GLOBAL_POSITION_INT", 7, 1, 5)
    assert (body.time_boot_ms, body.lat, body.lon) == (120_000, 404_203_000, -869_300_000)
    assert (body.alt, body.relative_alt, body.vx, body.vy, body.vz, body.hdg) == (336_500, 150_250, -120, 340, -5, 9000)


def test_numbers_that_are_none_come_through() -> None:
    frame = bytes(codec().wind_encode(math.nan, math.inf, -0.0).pack(codec()))
    (heard,) = FrameReader(PATH, codec()).feed(frame)
    assert math.isnan(heard.body.direction)
    assert heard.body.speed == math.inf


@settings(max_examples=40, deadline=None)
@given(st.lists(st.tuples(numbers.filter(v2.mavlink_map.__contains__), payloads, st.sampled_from("gsbo")), max_size=8))
def test_with_a_key_only_what_it_signed_is_read(parts: list[tuple[int, bytes, str]]) -> None:
    """g: unsigned; s: signed well; b: a signature of another key; o: signed, and sent once more."""
    signer, stranger, chunks = codec(KEY), codec(bytes(32)), []
    stranger.signing.link_id = 9  # pymavlink notes a forged time stamp, too; test_link_signing.py sees to that
    for number, payload, how in parts:
        if how == "g":
            chunks.append(frame_from(number, payload))
            continue
        frame = signed(stranger if how == "b" else signer, number, payload)
        chunks += [frame, frame] if how == "o" else [frame]
    read = by_reader(chunks, KEY)
    assert read == by_pymavlink(chunks, KEY)
    assert len(read) == sum(how in "so" for _, _, how in parts)


def signed(by: Any, number: int, payload: bytes) -> bytes:
    frame = frame_from(number, payload, flags=1)
    message = v2.MAVLink_heartbeat_message(0, 0, 0, 0, 0, 3)
    message._msgbuf = bytearray(frame)
    message.sign_packet(by)
    return bytes(message._msgbuf)


def test_what_is_kept_is_what_was_read() -> None:
    kept: list[bytes] = []
    frames = [frame_from(30, b"\x01\x02"), frame_from(74, b"\x03"), heartbeat_v1(3)]
    wrong = flipped(frames[0], 12, 1)
    heard: list[Heard] = FrameReader(PATH, codec()).feed(b"xx" + wrong + b"".join(frames), kept.append)
    assert kept == frames
    assert [h.name for h in heard] == ["ATTITUDE", "VFR_HUD", "HEARTBEAT"]
