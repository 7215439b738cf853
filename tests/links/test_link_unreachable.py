"""A network that is gone takes no flight with it: what cannot be sent is dropped and told, and the link goes on."""

import errno
import os

import pytest
from link_peer import Peer

from gcs.links.mavsdk_link import MavsdkFleetLink
from gcs.links.pymavlink_link import PymavlinkFleetLink
from gcs.links.transport import UdpTransport, open_transport


class Gone:
    """A socket's calls while its network is down, as Linux answers them: the first few of each."""

    def __init__(self, own: object, number: int, times: int = 3) -> None:
        self._own, self._number, self.left = own, number, times

    def _fail(self) -> None:
        if self.left > 0:
            self.left -= 1
            raise OSError(self._number, os.strerror(self._number))

    def send(self, data: bytes, peer: tuple[str, int]) -> None:
        self._fail()
        self._own.send(data, peer)  # type: ignore[attr-defined]

    def receive(self) -> list[tuple[bytes, tuple[str, int]]]:
        self._fail()
        return self._own.receive()  # type: ignore[attr-defined, no-any-return]


def broken(transport: UdpTransport, number: int, times: int = 3) -> Gone:
    transport._datagrams = Gone(transport._datagrams, number, times)  # type: ignore[assignment]
    return transport._datagrams  # type: ignore[return-value]


@pytest.mark.parametrize("number", [errno.ENETUNREACH, errno.EHOSTUNREACH, errno.ENETDOWN, errno.EPERM, errno.ENOBUFS])
def test_what_cannot_be_sent_or_read_is_dropped_and_told_once(number: int) -> None:
    transport = open_transport("udpout:127.0.0.1:9")
    assert isinstance(transport, UdpTransport)
    gone = broken(transport, number, 2)
    try:
        transport.write(b"x", None)
        assert transport.read(0.0) == []
        assert gone.left == 0
        assert transport.take_trouble() == os.strerror(number)
        assert transport.take_trouble() == ""
    finally:
        transport.close()


@pytest.mark.parametrize("kind", [PymavlinkFleetLink, MavsdkFleetLink])
def test_one_dead_network_leaves_the_other_drones_their_stream(
    kind: type[PymavlinkFleetLink | MavsdkFleetLink],
) -> None:
    """One drone's Wi-Fi is gone; the tick that sends to both goes on, and an operator is told which and why."""
    dead, alive = Peer(1), Peer(2)
    link = kind([dead.address, alive.address])
    try:
        broken(link._wire._transports[dead.address], errno.ENETUNREACH, 10_000)  # type: ignore[attr-defined]
        for tick in range(3):
            link.poll(0.1 * tick)
            link.flush(0.1 * tick)
        link.poll(10.0)
        told = [words for words in link.drain_notices() if dead.address in words]
        assert len(told) == 2, "at once, then every five seconds"
        assert "Network is unreachable" in told[0]
        if kind is PymavlinkFleetLink:
            assert [m.get_type() for m in alive.read()] == ["HEARTBEAT"]
    finally:
        link.close()
        for peer in (dead, alive):
            peer.socket.close()
