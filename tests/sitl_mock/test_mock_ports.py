"""The ways to a vehicle: who is answered, who is forgotten."""

from __future__ import annotations

import os
import socket
from typing import TYPE_CHECKING

import pytest

from sitl_mock.ports import MAX_PEERS, PortTakenError, SerialPort, TcpPort, UdpPort

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture
def port() -> Iterator[UdpPort]:
    port = UdpPort("127.0.0.1", 0, None)
    yield port
    port.close()


def peer() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 0))
    made.settimeout(2.0)
    return made


def test_each_is_answered_alone_and_all_together(port: UdpPort) -> None:
    with peer() as one, peer() as two:
        one.sendto(b"1", port.address)
        two.sendto(b"2", port.address)
        first, second = port.drain()
        assert (first.data, second.data) == (b"1", b"2")
        port.send(first.peer, b"only you")
        port.send(None, b"both")
        assert [one.recv(64), one.recv(64)] == [b"only you", b"both"]
        assert two.recv(64) == b"both"
        one.sendto(b"again", port.address)
        assert port.drain()[0].peer == first.peer


def test_the_longest_silent_is_forgotten_but_never_the_target() -> None:
    with peer() as target:
        port = UdpPort("127.0.0.1", 0, target.getsockname())
        peers = [peer() for _ in range(MAX_PEERS)]
        try:
            received = []
            for each in peers:
                each.sendto(b"x", port.address)
                received += port.drain()
            assert [got.forgotten for got in received] == [None] * (MAX_PEERS - 1) + [received[0].peer]
            port.send(received[0].peer, b"gone")
            port.send(None, b"all")
            assert target.recv(64) == b"all"
            assert peers[-1].recv(64) == b"all"
            peers[0].setblocking(False)
            with pytest.raises(BlockingIOError):
                peers[0].recv(64)
        finally:
            for each in peers:
                each.close()
            port.close()


def test_a_taken_port_says_so(port: UdpPort) -> None:
    with pytest.raises(PortTakenError, match="--first-port"):
        UdpPort("127.0.0.1", port.address[1], None)


def _drained(port: TcpPort) -> list[bytes]:
    return [received.data for received in port.drain()]


def test_tcp_callers_are_peers_and_may_hang_up() -> None:
    port = TcpPort("127.0.0.1", 0)
    try:
        with (
            socket.create_connection(port.address, timeout=2) as one,
            socket.create_connection(port.address, timeout=2),
        ):
            assert _drained(port) == []
            assert _drained(port) == []  # one caller is taken a time
            one.sendall(b"hello")
            (first,) = port.drain()
            assert first.data == b"hello"
            port.send(first.peer, b"you")
            port.send(None, b" all")
            got = b""
            while len(got) < 7:
                got += one.recv(64)
            assert got == b"you all"
        gone = port.drain() + port.drain()
        assert {received.forgotten for received in gone} == {1, 2}
        assert port.drain() == []
    finally:
        port.close()


def test_a_taken_tcp_port_says_so() -> None:
    first = TcpPort("127.0.0.1", 0)
    with pytest.raises(PortTakenError, match="--tcp-first-port"):
        TcpPort("127.0.0.1", first.address[1])
    first.close()


def test_a_serial_line_carries_any_byte_both_ways() -> None:
    port = SerialPort()
    far = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
    every = bytes(range(256))
    try:
        os.write(far, every)
        assert b"".join(received.data for received in port.drain()) == every
        port.send(None, every)
        assert os.read(far, 512) == every
        os.close(far)
        for _ in range(200):  # nobody reads: the buffer fills, nothing blocks
            port.send(None, every)
        assert port.dropped > 0
    finally:
        port.close()
