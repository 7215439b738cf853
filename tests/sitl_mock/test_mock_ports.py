"""The vehicles' UDP ports: who is answered, who is forgotten."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING

import pytest

from sitl_mock.ports import MAX_PEERS, Port, PortTakenError

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture
def port() -> Iterator[Port]:
    port = Port("127.0.0.1", 0, None)
    yield port
    port.close()


def peer() -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.bind(("127.0.0.1", 0))
    made.settimeout(2.0)
    return made


def test_each_is_answered_alone_and_all_together(port: Port) -> None:
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
        port = Port("127.0.0.1", 0, target.getsockname())
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


def test_a_taken_port_says_so(port: Port) -> None:
    with pytest.raises(PortTakenError, match="--first-port"):
        Port("127.0.0.1", port.address[1], None)
