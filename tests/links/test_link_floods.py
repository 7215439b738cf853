"""More than can be read: the newest counts, the rest is told, and reading ends."""

import socket
from collections.abc import Iterator

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from gcs.links.datagrams import AT_ONCE, Datagrams
from gcs.links.fleet_link import OVERRUN_NOTICE_S
from gcs.links.pymavlink_link import PymavlinkFleetLink
from gcs.links.transport import LEAST_KEPT, MOST_READS, UdpTransport, open_all


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def peer() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        yield made


def test_the_newest_are_kept_in_order(peer: socket.socket) -> None:
    port = free_port()
    transport = UdpTransport("udpin", ("127.0.0.1", port), listening=True, kept=10)
    for number in range(25):
        peer.sendto(bytes([number]), ("127.0.0.1", port))
    assert [data[0] for _, data in transport.read(0.0)] == list(range(15, 25))
    assert transport.skipped == 15
    peer.sendto(b"\x63", ("127.0.0.1", port))
    assert [data for _, data in transport.read(0.1)] == [b"\x63"]
    assert transport.skipped == 15
    transport.close()


def test_a_flood_without_end_does_not_keep_the_flight(monkeypatch: pytest.MonkeyPatch, peer: socket.socket) -> None:
    transport = UdpTransport("udpin", ("127.0.0.1", free_port()), listening=True, kept=10)
    count = iter(range(10 * MOST_READS))

    class Endless(Datagrams):
        def receive(self) -> list[tuple[bytes, tuple[str, int]]]:
            return [(next(count).to_bytes(4, "little"), ("127.0.0.1", 9)) for _ in range(AT_ONCE)]

    monkeypatch.setattr(transport, "_datagrams", Endless(peer))
    assert len(transport.read(0.0)) == 10
    assert transport.skipped == MOST_READS - 10
    transport.close()


def test_many_sockets_share_what_can_be_decoded() -> None:
    transports = open_all([f"udpout:127.0.0.1:{20_000 + index}" for index in range(100)])
    assert {transport._kept for transport in transports if isinstance(transport, UdpTransport)} == {LEAST_KEPT}
    for transport in transports:
        transport.close()


def test_an_operator_is_told_and_the_newest_place_stands(peer: socket.socket) -> None:
    port = free_port()
    link = PymavlinkFleetLink([f"udpin:127.0.0.1:{port}"])
    codec = mavlink.MAVLink(None, srcSystem=3, srcComponent=1)
    beat = codec.heartbeat_encode(mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, 0, 0, 3)
    try:
        peer.sendto(bytes(beat.pack(codec)), ("127.0.0.1", port))
        link.poll(0.0)
        for number in range(3_000):
            place = codec.global_position_int_encode(number, 474_000_000 + number, 85_000_000, 500, 100, 0, 0, 0, 0)
            peer.sendto(bytes(place.pack(codec)), ("127.0.0.1", port))
        link.poll(OVERRUN_NOTICE_S)
        assert link.vehicles()[3].lat_deg == pytest.approx(47.4 + 2_999e-7, abs=1e-9)
        (notice,) = link.drain_notices()[-1:]
        assert f"udpin:127.0.0.1:{port}: 1000 datagrams" in notice
        link.poll(2 * OVERRUN_NOTICE_S)
        assert link.drain_notices() == ()
    finally:
        link.close()
