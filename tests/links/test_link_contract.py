"""One contract for both links, over real UDP sockets, against a peer that speaks through pymavlink's own encoder."""

from collections.abc import Iterator

import pytest
from link_peer import PX4_OFFBOARD, Desk, Passed, Peer
from pymavlink.dialects.v20 import common as mav

from gcs.links.fleet_link import CONFLICT_OVER_S, VELOCITY_AND_YAW, WiredFleetLink
from gcs.links.mavsdk_link import MavsdkFleetLink
from gcs.links.pymavlink_link import PymavlinkFleetLink
from gcs.links.transport import LinkError
from gcs.links.wire import OWN_SYSTEM_ID
from gcs.ports import CommandKind, FlightMode, VehicleCommand, VelocitySetpoint, VerdictResult

LINKS: dict[str, type[WiredFleetLink]] = {"pymavlink": PymavlinkFleetLink, "mavsdk": MavsdkFleetLink}


@pytest.fixture(params=LINKS)
def kind(request: pytest.FixtureRequest) -> type[WiredFleetLink]:
    return LINKS[request.param]


@pytest.fixture
def peer() -> Iterator[Peer]:
    made = Peer()
    yield made
    made.close()


@pytest.fixture
def desk(kind: type[WiredFleetLink], peer: Peer) -> Iterator[Desk]:
    made = Desk(kind([peer.address]))
    yield made
    made.link.close()


def known(desk: Desk, peer: Peer) -> None:
    """The link greets, the vehicle answers with a heartbeat, and the link knows it and can be understood."""
    desk.receive(peer, "HEARTBEAT")

    def met() -> bool:
        peer.heartbeat()
        return 1 in desk.link.vehicles()

    desk.until(met)


def test_it_greets_as_our_ground_station(desk: Desk, peer: Peer) -> None:
    greeting = desk.receive(peer, "HEARTBEAT")
    assert (greeting.get_srcSystem(), greeting.type) == (OWN_SYSTEM_ID, mav.MAV_TYPE_GCS)


def test_a_vehicle_is_known_by_its_heartbeat(desk: Desk, peer: Peer) -> None:
    known(desk, peer)
    status = desk.link.vehicles()[1]
    assert (status.autopilot, status.mode, status.armed) == ("px4", FlightMode.GUIDED, True)


def test_a_gimbals_heartbeat_does_not_change_the_mode(desk: Desk, peer: Peer) -> None:
    known(desk, peer)
    peer.heartbeat(autopilot=mav.MAV_AUTOPILOT_INVALID, kind=26, custom=0)
    peer.position()
    desk.until(lambda: desk.link.vehicles()[1].lat_deg is not None)
    assert desk.link.vehicles()[1].mode is FlightMode.GUIDED


def test_position_by_hand(desk: Desk, peer: Peer) -> None:
    known(desk, peer)
    peer.position()
    desk.until(lambda: desk.link.vehicles()[1].lat_deg is not None)
    status = desk.link.vehicles()[1]
    assert (status.lat_deg, status.lon_deg) == (pytest.approx(40.4203), pytest.approx(-86.93))
    assert (status.alt_amsl_m, status.alt_home_m) == (300.0, 120.0)
    assert status.vel_ned_mps == (18.0, -0.5, 0.25)


def test_setpoint_fields(desk: Desk, peer: Peer) -> None:
    known(desk, peer)
    desk.link.send(Passed(VelocitySetpoint(1, (3.0, -4.0, 0.5), 3.5)), 12.5)
    message = desk.receive(peer, "SET_POSITION_TARGET_GLOBAL_INT")
    assert (message.vx, message.vy, message.vz) == (3.0, -4.0, 0.5)
    assert message.yaw == pytest.approx(3.5 - 2 * 3.14159265, abs=1e-5)
    assert message.type_mask == VELOCITY_AND_YAW == 2503
    assert message.coordinate_frame == 6
    assert (message.target_system, message.target_component) == (1, 1)
    assert message.time_boot_ms == 12_500


def test_nothing_leaves_without_the_gate(desk: Desk, peer: Peer) -> None:
    with pytest.raises(ValueError, match="gate"):
        desk.link.send(Passed(VelocitySetpoint(1, (0.0, 0.0, 0.0), 0.0), passed_gate=False), 0.0)
    with pytest.raises(ValueError, match="finite"):
        desk.link.send(Passed(VelocitySetpoint(1, (float("nan"), 0.0, 0.0), 0.0)), 0.0)


def test_an_order_and_its_verdict(desk: Desk, peer: Peer) -> None:
    known(desk, peer)
    ticket = desk.link.submit(VehicleCommand(CommandKind.ARM, 1), desk.now_s)
    message = desk.receive(peer, "COMMAND_LONG", lambda m: m.command == 400)
    assert (message.get_srcSystem(), message.param1) == (OWN_SYSTEM_ID, 1.0)
    peer.say(peer.codec.command_ack_encode(400, 0, 0, 0, OWN_SYSTEM_ID, 190))
    desk.until(lambda: ticket.verdict)
    assert ticket.verdict is not None
    assert ticket.verdict.accepted


def test_nan_travels(desk: Desk, peer: Peer) -> None:
    """PX4 takes NaN for "here"; a library that speaks JSON could make a zero of it, off the coast of Africa."""
    known(desk, peer)
    desk.link.submit(VehicleCommand(CommandKind.LAND, 1), desk.now_s)
    message = desk.receive(peer, "COMMAND_LONG", lambda m: m.command == 21)
    assert [message.param4 != message.param4, message.param5 != message.param5, message.param6 != message.param6] == [
        True,
        True,
        True,
    ]
    assert message.param1 == 0.0


def test_a_refusal_carries_the_vehicles_words(desk: Desk, peer: Peer) -> None:
    known(desk, peer)
    ticket = desk.link.submit(VehicleCommand(CommandKind.ARM, 1), desk.now_s)
    desk.receive(peer, "COMMAND_LONG", lambda m: m.command == 400)
    peer.say(peer.codec.statustext_encode(4, b"Arm: compass not healthy"))
    peer.say(peer.codec.command_ack_encode(400, 4, 0, 0, OWN_SYSTEM_ID, 190))
    desk.until(lambda: ticket.verdict)
    assert ticket.verdict is not None
    assert ticket.verdict.result is VerdictResult.REFUSED
    assert "compass not healthy" in ticket.verdict.reason


def test_an_ack_for_another_ground_station_is_not_ours(desk: Desk, peer: Peer) -> None:
    known(desk, peer)
    ticket = desk.link.submit(VehicleCommand(CommandKind.ARM, 1), desk.now_s)
    desk.receive(peer, "COMMAND_LONG", lambda m: m.command == 400)
    peer.say(peer.codec.command_ack_encode(400, 0, 0, 0, 255, 190))
    peer.position()
    desk.until(lambda: desk.link.vehicles()[1].lat_deg is not None)
    assert ticket.verdict is None or not ticket.verdict.accepted


def test_an_unknown_vehicle_gets_no_order(desk: Desk) -> None:
    ticket = desk.link.submit(VehicleCommand(CommandKind.ARM, 9), 0.0)
    assert ticket.verdict is not None
    assert ticket.verdict.result is VerdictResult.NOT_SENT


def test_parameters_are_read_and_become_limits(desk: Desk, peer: Peer) -> None:
    known(desk, peer)
    asked = desk.receive(peer, "PARAM_REQUEST_READ", lambda m: m.param_id == "MPC_XY_VEL_MAX")
    assert asked.target_system == 1
    peer.say(peer.codec.param_value_encode(b"MPC_XY_VEL_MAX", 12.0, 9, 1, 0))
    desk.until(lambda: desk.link.vehicles()[1].limits.max_speed_mps == 12.0)


def test_the_round_trip_is_measured_by_timesync(desk: Desk, peer: Peer) -> None:
    known(desk, peer)

    def answered() -> bool:
        for message in peer.read():
            if message.get_type() == "TIMESYNC" and message.tc1 == 0:
                peer.say(peer.codec.timesync_encode(123, message.ts1))
        return desk.link.vehicles()[1].latency_s is not None

    desk.until(answered)
    status = desk.link.vehicles()[1]
    assert 0.0 <= (status.latency_s or 0.0) < 10.0
    assert status.answered_s is not None


def test_lost_messages_are_counted(desk: Desk, peer: Peer) -> None:
    known(desk, peer)
    for number in range(200):
        peer.codec.seq = (2 * number) % 256
        peer.position(boot_ms=1000 + number)
        if number % 20 == 0:
            desk.tick()
    desk.until(lambda: desk.link.vehicles()[1].loss_ratio > 0.4)
    assert desk.link.vehicles()[1].links[0].loss_ratio < 0.55


def test_its_heartbeats_end_when_the_loop_stalls(desk: Desk, peer: Peer) -> None:
    """A thread of a library's own would go on to vouch for a dead loop."""
    known(desk, peer)
    desk.receive(peer, "HEARTBEAT")
    while peer.read():
        pass
    peer.socket.settimeout(3.0)
    assert not peer.read(), "nothing leaves while nobody ticks"


def test_a_second_vehicle_with_the_same_id_is_refused(kind: type[WiredFleetLink]) -> None:
    first, second = Peer(1), Peer(1)
    desk = Desk(kind([first.address, second.address]))
    known(desk, first)
    desk.receive(second, "HEARTBEAT")

    def noticed() -> tuple[str, ...]:
        first.heartbeat(custom=PX4_OFFBOARD)
        second.heartbeat(custom=3 << 16)
        return desk.link.drain_notices()

    (notice,) = desk.until(noticed)
    assert desk.link.vehicles()[1].mode is FlightMode.GUIDED
    assert "second vehicle" in desk.link.vehicles()[1].conflict
    assert "own system id" in notice
    seen_s = desk.now_s

    def switched_off() -> bool:
        first.heartbeat(custom=PX4_OFFBOARD)
        return not desk.link.vehicles()[1].conflict

    desk.until(switched_off)
    took_s = desk.now_s - seen_s
    for end in (desk.link, first, second):
        end.close()
    assert took_s == pytest.approx(CONFLICT_OVER_S, abs=1.5)


def test_a_second_vehicle_is_not_taken_for_the_first_when_that_falls_silent(kind: type[WiredFleetLink]) -> None:
    """It has been up for another time. The first one's setpoints would go to it, and the first one would get none."""
    first, second = Peer(1), Peer(1)
    desk = Desk(kind([first.address, second.address]))
    known(desk, first)
    desk.receive(second, "HEARTBEAT")

    def both() -> str:
        first.heartbeat(custom=PX4_OFFBOARD)
        first.position(boot_ms=round(1e3 * desk.now_s) + 100_000)
        second.heartbeat(custom=3 << 16)
        second.position(boot_ms=round(1e3 * desk.now_s) + 900_000)
        return desk.link.vehicles()[1].conflict

    desk.until(both)
    for _ in range(3):  # each has said how long it has been up
        desk.until(both)
    alone_s = desk.now_s

    def second_alone() -> bool:
        second.heartbeat(custom=3 << 16)
        second.position(boot_ms=round(1e3 * desk.now_s) + 900_000)
        return desk.link.vehicles()[1].mode is not FlightMode.GUIDED

    desk.until(second_alone)
    assert desk.now_s - alone_s > 50.0, "long enough for a campaign to give the first one up"
    for end in (desk.link, first, second):
        end.close()


def test_an_address_with_another_vehicle_is_refused(kind: type[WiredFleetLink]) -> None:
    peer = Peer(7)
    desk = Desk(kind([peer.address], expected={peer.address: 2}))
    desk.receive(peer, "HEARTBEAT")

    def noticed() -> tuple[str, ...]:
        peer.heartbeat()
        return desk.link.drain_notices()

    assert "expected vehicle 2" in desk.until(noticed)[0]
    assert not desk.link.vehicles()
    desk.link.close()
    peer.close()


def test_rubbish_between_frames_is_survived(desk: Desk, peer: Peer) -> None:
    known(desk, peer)
    peer.socket.sendto(b"\xfd\x09garbage" * 40, peer.ground)

    def moved() -> bool:
        peer.position()
        return desk.link.vehicles()[1].lat_deg is not None

    desk.until(moved)


def test_a_bad_address_leaves_nothing_open(kind: type[WiredFleetLink]) -> None:
    with pytest.raises(LinkError):
        kind(["udpin:127.0.0.1:24552", "nonsense"])
    kind(["udpin:127.0.0.1:24552"]).close()


# --- several links to one vehicle ---------------------------------------------------------------------------------


def test_two_links_to_one_vehicle(kind: type[WiredFleetLink]) -> None:
    """The first one counts, urgent orders go over both, and the second takes over when the first falls silent."""
    first, second = Peer(1), Peer(1)
    desk = Desk(kind([first.address, second.address], expected={first.address: 1, second.address: 1}))
    known(desk, first)
    desk.receive(second, "HEARTBEAT")

    def both() -> bool:
        first.heartbeat(custom=PX4_OFFBOARD)
        second.heartbeat(custom=3 << 16)  # an old mode, late on a slow link
        return len(desk.link.vehicles()[1].links) == 2

    desk.until(both)
    desk.until(both)
    status = desk.link.vehicles()[1]
    assert not desk.link.drain_notices()
    assert [link.primary for link in status.links] == [True, False]
    assert status.mode is FlightMode.GUIDED
    desk.link.submit(VehicleCommand(CommandKind.HOLD, 1, urgent=True), desk.now_s)
    for end in (first, second):
        assert desk.receive(end, "COMMAND_LONG", lambda m: m.command == 176).param2 == 4.0

    def second_only() -> bool:
        second.heartbeat(custom=3 << 16)
        return desk.link.vehicles()[1].links[0].address == second.address

    desk.until(second_only)
    desk.link.send(Passed(VelocitySetpoint(1, (1.0, 0.0, 0.0), 0.0)), desk.now_s)
    desk.receive(second, "SET_POSITION_TARGET_GLOBAL_INT")
    for end in (desk.link, first, second):
        end.close()


def test_two_vehicles_behind_two_links_of_one_drone_are_told_apart_by_their_clocks(kind: type[WiredFleetLink]) -> None:
    first, second = Peer(1), Peer(1)
    desk = Desk(kind([first.address, second.address], expected={first.address: 1, second.address: 1}))
    known(desk, first)
    desk.receive(second, "HEARTBEAT")

    def conflict() -> str:
        for end, boot_ms in ((first, 100_000), (second, 900_000)):
            end.heartbeat()
            end.position(boot_ms=boot_ms)
        return desk.link.vehicles()[1].conflict

    assert "two vehicles" in desk.until(conflict)
    for end in (desk.link, first, second):
        end.close()
