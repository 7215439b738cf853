"""The link over real UDP sockets, against a peer that speaks through pymavlink's own encoder."""

import socket
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from pymavlink.dialects.v20 import common as mav

from gcs.links.pymavlink_link import OWN_SYSTEM_ID, VELOCITY_AND_YAW, PymavlinkFleetLink
from gcs.links.transport import LinkError
from gcs.ports import CommandKind, FlightMode, VehicleCommand, VelocitySetpoint, VerdictResult


@dataclass(frozen=True)
class Passed:
    setpoint: VelocitySetpoint
    passed_gate: bool = True


class Peer:
    """A vehicle's end of the wire: a bound socket and a codec."""

    def __init__(self, system_id: int = 1) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(2.0)
        self.codec = mav.MAVLink(None, srcSystem=system_id, srcComponent=1)
        self.ground = ("127.0.0.1", 0)

    @property
    def address(self) -> str:
        return f"udpout:127.0.0.1:{self.socket.getsockname()[1]}"

    def read(self) -> list[object]:
        data, self.ground = self.socket.recvfrom(4096)
        return list(self.codec.parse_buffer(data) or [])

    def read_until(self, name: str) -> object:
        while True:
            for message in self.read():
                if message.get_type() == name:  # type: ignore[attr-defined]
                    return message

    def say(self, message: object) -> None:
        data = message.pack(self.codec)  # type: ignore[attr-defined]
        self.codec.seq = (self.codec.seq + 1) % 256
        self.socket.sendto(data, self.ground)

    def heartbeat(self, autopilot: int = mav.MAV_AUTOPILOT_PX4, kind: int = 2, custom: int = 6 << 16) -> None:
        self.say(self.codec.heartbeat_encode(kind, autopilot, 128, custom, 4))


@pytest.fixture
def pair() -> Iterator[tuple[Peer, PymavlinkFleetLink]]:
    peer = Peer()
    link = PymavlinkFleetLink([peer.address])
    link.flush(0.0)
    greeting = peer.read_until("HEARTBEAT")
    assert greeting.get_srcSystem() == OWN_SYSTEM_ID  # type: ignore[attr-defined]
    yield peer, link
    link.close()
    peer.socket.close()


def test_a_vehicle_is_known_by_its_heartbeat(pair: tuple[Peer, PymavlinkFleetLink]) -> None:
    peer, link = pair
    peer.heartbeat()
    link.poll(0.1)
    status = link.vehicles()[1]
    assert (status.autopilot, status.mode, status.armed) == ("px4", FlightMode.GUIDED, True)


def test_a_gimbals_heartbeat_does_not_change_the_mode(pair: tuple[Peer, PymavlinkFleetLink]) -> None:
    peer, link = pair
    peer.heartbeat()
    peer.heartbeat(autopilot=mav.MAV_AUTOPILOT_INVALID, kind=26, custom=0)
    link.poll(0.1)
    assert link.vehicles()[1].mode is FlightMode.GUIDED


def test_position_by_hand(pair: tuple[Peer, PymavlinkFleetLink]) -> None:
    peer, link = pair
    peer.heartbeat()
    peer.say(
        peer.codec.global_position_int_encode(1000, 404_203_000, -869_300_000, 300_000, 120_000, 1800, -50, 25, 9000)
    )
    link.poll(0.1)
    status = link.vehicles()[1]
    assert (status.lat_deg, status.lon_deg) == (pytest.approx(40.4203), pytest.approx(-86.93))
    assert (status.alt_amsl_m, status.alt_home_m) == (300.0, 120.0)
    assert status.vel_ned_mps == (18.0, -0.5, 0.25)


def test_setpoint_fields(pair: tuple[Peer, PymavlinkFleetLink]) -> None:
    peer, link = pair
    peer.heartbeat()
    link.poll(0.1)
    link.send(Passed(VelocitySetpoint(1, (3.0, -4.0, 0.5), 3.5)), 12.5)
    message = peer.read_until("SET_POSITION_TARGET_GLOBAL_INT")
    assert (message.vx, message.vy, message.vz) == (3.0, -4.0, 0.5)  # type: ignore[attr-defined]
    assert message.yaw == pytest.approx(3.5 - 2 * 3.14159265, abs=1e-5)  # type: ignore[attr-defined]
    assert message.type_mask == VELOCITY_AND_YAW == 2503  # type: ignore[attr-defined]
    assert message.coordinate_frame == 6  # type: ignore[attr-defined]
    assert (message.target_system, message.target_component) == (1, 1)  # type: ignore[attr-defined]


def test_nothing_leaves_without_the_gate(pair: tuple[Peer, PymavlinkFleetLink]) -> None:
    _, link = pair
    with pytest.raises(ValueError, match="gate"):
        link.send(Passed(VelocitySetpoint(1, (0.0, 0.0, 0.0), 0.0), passed_gate=False), 0.0)
    with pytest.raises(ValueError, match="finite"):
        link.send(Passed(VelocitySetpoint(1, (float("nan"), 0.0, 0.0), 0.0)), 0.0)


def test_an_order_and_its_verdict(pair: tuple[Peer, PymavlinkFleetLink]) -> None:
    peer, link = pair
    peer.heartbeat()
    link.poll(0.1)
    ticket = link.submit(VehicleCommand(CommandKind.ARM, 1), 0.1)
    link.flush(0.1)
    message = peer.read_until("COMMAND_LONG")
    while message.command != 400:  # type: ignore[attr-defined]
        message = peer.read_until("COMMAND_LONG")
    peer.say(peer.codec.command_ack_encode(400, 0, 0, 0, OWN_SYSTEM_ID, 190))
    link.poll(0.2)
    assert ticket.verdict is not None
    assert ticket.verdict.accepted


def test_an_ack_for_another_ground_station_is_not_ours(pair: tuple[Peer, PymavlinkFleetLink]) -> None:
    peer, link = pair
    peer.heartbeat()
    link.poll(0.1)
    ticket = link.submit(VehicleCommand(CommandKind.ARM, 1), 0.1)
    link.flush(0.1)
    peer.say(peer.codec.command_ack_encode(400, 0, 0, 0, 255, 190))
    link.poll(0.2)
    assert ticket.verdict is None


def test_an_unknown_vehicle_gets_no_order(pair: tuple[Peer, PymavlinkFleetLink]) -> None:
    _, link = pair
    ticket = link.submit(VehicleCommand(CommandKind.ARM, 9), 0.0)
    assert ticket.verdict is not None
    assert ticket.verdict.result is VerdictResult.NOT_SENT


def test_a_second_vehicle_with_the_same_id_is_refused() -> None:
    first, second = Peer(1), Peer(1)
    link = PymavlinkFleetLink([first.address, second.address])
    link.flush(0.0)
    first.read_until("HEARTBEAT")
    second.read_until("HEARTBEAT")
    first.heartbeat(custom=6 << 16)
    link.poll(0.1)
    second.heartbeat(custom=3 << 16)
    link.poll(0.2)
    assert link.vehicles()[1].mode is FlightMode.GUIDED
    (notice,) = link.drain_notices()
    assert "vehicle 1" in notice
    assert "own system id" in notice
    link.close()
    first.socket.close()
    second.socket.close()


def test_an_address_with_another_vehicle_is_refused() -> None:
    peer = Peer(7)
    link = PymavlinkFleetLink([peer.address], expected={peer.address: 2})
    link.flush(0.0)
    peer.read_until("HEARTBEAT")
    peer.heartbeat()
    link.poll(0.1)
    assert not link.vehicles()
    assert "expected vehicle 2" in link.drain_notices()[0]
    link.close()
    peer.socket.close()


def test_rubbish_between_frames_is_survived(pair: tuple[Peer, PymavlinkFleetLink]) -> None:
    peer, link = pair
    peer.socket.sendto(b"\xfd\x09garbage" * 40, peer.ground)
    peer.heartbeat()
    link.poll(0.1)
    peer.heartbeat()
    link.poll(0.2)
    assert 1 in link.vehicles()


def test_a_bad_address_leaves_nothing_open() -> None:
    with pytest.raises(LinkError):
        PymavlinkFleetLink(["udpin:127.0.0.1:24552", "nonsense"])
    link = PymavlinkFleetLink(["udpin:127.0.0.1:24552"])
    link.close()
