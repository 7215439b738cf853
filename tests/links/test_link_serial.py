"""A serial line, played by a pseudo terminal: bytes both ways, a cable that is pulled, a device that is not there."""

import os
import pty
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest

from gcs.links.transport import LinkError, SerialTransport, open_transport


@pytest.fixture
def line() -> Iterator[tuple[int, SerialTransport]]:
    far, near = pty.openpty()
    tty.setraw(near)
    device = os.ttyname(near)
    os.close(near)
    transport = open_transport(f"serial:{device}:57600")
    assert isinstance(transport, SerialTransport)
    yield far, transport
    transport.close()


def test_bytes_go_both_ways_and_nothing_blocks(line: tuple[int, SerialTransport]) -> None:
    far, transport = line
    assert transport.read(0.0) == []
    os.write(far, b"\xfd hello")
    ((peer, data),) = transport.read(0.1)
    assert data == b"\xfd hello"
    assert transport.peers() == [peer]
    transport.write(b"answer", peer)
    assert os.read(far, 100) == b"answer"
    os.close(far)


def test_a_pulled_cable_is_silence_and_not_a_crash(line: tuple[int, SerialTransport]) -> None:
    far, transport = line
    os.close(far)
    for tick in range(30):
        assert transport.read(0.1 * tick) == []
        transport.write(b"into the void", None)


def test_a_device_that_is_not_there_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match="plug it in"):
        open_transport(f"serial:{tmp_path / 'ttyUSB0'}:57600")
