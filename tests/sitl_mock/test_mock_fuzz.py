"""Mutated frames and random bytes: no crash, no memory growth, state unchanged.

MOCK_FUZZ_FRAMES says how many, a million if it is not set. The same seed gives the same bytes.
"""

from __future__ import annotations

import io
import os
import tracemalloc
from typing import Any

import numpy as np
import pytest
from mock_station import fly, mav, station
from numpy.typing import NDArray

from sitl_mock.wire import Parser

FRAMES = int(os.environ.get("MOCK_FUZZ_FRAMES", "1000000"))
_CHUNK = 5000  # frames at a time
_FRAMING = (0, 1, 2)  # magic, length and flags: changing these moves the checksum
Bytes = NDArray[np.uint8]


def _orders() -> list[bytes]:
    """Frames that would change the vehicle if they were taken."""
    sender = mav.MAVLink(io.BytesIO(), srcSystem=245, srcComponent=190)
    messages = [
        mav.MAVLink_command_long_message(1, 1, 400, 0, 0, 21196, 0, 0, 0, 0, 0),
        mav.MAVLink_command_long_message(1, 1, 176, 0, 1, 6, 0, 0, 0, 0, 0),
        mav.MAVLink_command_long_message(1, 1, 185, 0, 1, 0, 0, 0, 0, 0, 0),
        mav.MAVLink_param_set_message(1, 1, b"RTL_ALT", 9.0, 9),
        mav.MAVLink_set_mode_message(1, 1, 9),
        mav.MAVLink_mission_count_message(1, 1, 3, 0),
        mav.MAVLink_set_position_target_global_int_message(0, 1, 1, 6, 3527, 0, 0, 0, 9, 9, 9, 0, 0, 0, 0, 0),
        mav.MAVLink_setup_signing_message(1, 1, list(range(32)), 10**12),
    ]
    return [bytes(message.pack(sender)) for message in messages]


def _few_bits(frame: bytes, count: int, rng: np.random.Generator) -> bytes:
    """Copies with 1 to 3 bits flipped under the checksum: CRC-16/CCITT finds every such error of these lengths."""
    copies: Bytes = np.tile(np.frombuffer(frame, np.uint8), (count, 1))
    first_bit, bits = 8 * (max(_FRAMING) + 1), 8 * len(frame)
    places = first_bit + np.argsort(rng.random((count, bits - first_bit)), axis=1)[:, :3]
    wanted = rng.integers(1, 4, count)
    for turn in range(3):
        rows = np.flatnonzero(wanted > turn)
        np.bitwise_xor.at(copies, (rows, places[rows, turn] // 8), (1 << (places[rows, turn] % 8)).astype(np.uint8))
    return copies.tobytes()


def _anything(frame: bytes, count: int, rng: np.random.Generator) -> bytes:
    """Copies with any byte replaced, some cut short, random bytes in between."""
    pieces = []
    for _ in range(count):
        copy = bytearray(frame)
        copy[int(rng.integers(len(copy)))] = int(rng.integers(256))
        pieces += [bytes(copy[: int(rng.integers(1, len(copy) + 1))]), rng.bytes(int(rng.integers(0, 30)))]
    return b"".join(pieces)


def _memory_of(vehicle: Any) -> tuple[object, ...]:
    plans = {kind: tuple(items) for kind, items in vehicle.missions.plans.items()}
    params = tuple((param.name, param.value) for param in vehicle.params)
    return (
        vehicle.armed,
        vehicle.mode.name,
        vehicle.target,
        plans,
        params,
        vehicle.missions.upload,
        vehicle.signer.active,
    )


def test_mutated_frames_change_nothing() -> None:
    rng = np.random.default_rng(20)
    ground = station("ardupilot")
    fly(ground)
    before = _memory_of(ground.vehicle)
    orders, done = _orders(), 0
    while done < FRAMES:
        frame = orders[(done // _CHUNK) % len(orders)]
        ground.simulation.receive(0, 1, _few_bits(frame, _CHUNK, rng))
        done += _CHUNK
    assert _memory_of(ground.vehicle) == before
    assert ground.simulation._parsers[0, 1].bad_checksums > FRAMES / 2
    assert ground.command(512, 148) == 0  # and it still listens


def test_rubbish_neither_crashes_nor_piles_up() -> None:
    rng = np.random.default_rng(21)
    parser, taken, fed, peak = Parser(), 0, 0, []
    tracemalloc.start()
    try:
        for turn in range(max(FRAMES // 250_000, 4)):
            for frame in _orders():
                taken += len(parser.feed(_anything(frame, 500, rng)))
                fed += 500
            if turn:
                peak.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert peak[-1] - peak[0] < 20_000
    assert len(parser._buffer) < 300
    assert taken < 0.03 * fed  # one in 256 replaced bytes is the same again, of those that were not cut


@pytest.mark.parametrize("cut", [1, 7, 300])
def test_good_frames_survive_between_rubbish(cut: int) -> None:
    rng = np.random.default_rng(22)
    ping = bytes(mav.MAVLink_ping_message(5, 6, 0, 0).pack(mav.MAVLink(io.BytesIO(), srcSystem=9)))
    rubbish = bytes(byte for byte in rng.bytes(2000) if byte not in (0xFD, 0xFE))
    stream = (rubbish[:200] + ping) * 8
    parser = Parser()
    got = [frame for at in range(0, len(stream), cut) for frame in parser.feed(stream[at : at + cut])]
    assert len(got) == 8
