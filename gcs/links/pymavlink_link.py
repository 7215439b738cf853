"""The default link: every vehicle over pymavlink in one process, without ever waiting."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from gcs.links.commands import RefusedTicket
from gcs.links.latency import LatencyMeter
from gcs.links.loss import LossMeter
from gcs.links.session import VehicleSession
from gcs.links.tlog import TlogRecorder
from gcs.links.transport import LinkError, Peer, Transport, open_transport
from gcs.ports import CommandTicket, SafeSetpoint, VehicleCommand, VehicleStatus

OWN_SYSTEM_ID: Final = 245  # not 255: another ground station there would keep ArduPilot's failsafe quiet for us
OWN_COMPONENT_ID: Final = 190  # MAV_COMP_ID_MISSIONPLANNER
AUTOPILOT_COMPONENT: Final = 1  # MAV_COMP_ID_AUTOPILOT1
HEARTBEAT_S: Final = 1.0
MAX_VEHICLE_ID: Final = 250
CONFLICT_S: Final = 5.0  # a vehicle may move to another port after so long a silence
VELOCITY_AND_YAW: Final = 2503  # POSITION_TARGET_TYPEMASK: position, acceleration and yaw rate ignored
_VEHICLE_TYPES_EXCLUDED: Final = frozenset({5, 6, 18, 26, 27, 30})  # tracker, GCS, companion, gimbal, ADSB, camera


@dataclass
class _Route:
    """Where a vehicle was last heard."""

    transport: Transport
    peer: Peer
    heard_s: float


class PymavlinkFleetLink:
    """:class:`gcs.ports.FleetLink` over UDP and TCP addresses (see :mod:`gcs.links.transport`).

    ``expected`` maps an address to the system id that must answer there; others there are refused with a notice.
    """

    def __init__(
        self,
        addresses: Sequence[str],
        expected: Mapping[str, int] | None = None,
        recorder: TlogRecorder | None = None,
    ) -> None:
        self._expected, self._recorder = dict(expected or {}), recorder
        self._latencies: dict[int, LatencyMeter] = {}
        self._now_s = 0.0
        self._transports: list[Transport] = []
        try:
            for address in addresses:
                self._transports.append(open_transport(address))
        except LinkError:
            self.close()
            raise
        self._codec = mavlink.MAVLink(None, srcSystem=OWN_SYSTEM_ID, srcComponent=OWN_COMPONENT_ID)
        self._codec.robust_parsing = True
        self._parsers: dict[tuple[str, Peer], Any] = {}
        self._sessions: dict[int, VehicleSession] = {}
        self._routes: dict[int, _Route] = {}
        self._losses: dict[int, LossMeter] = {}
        self._notices: list[str] = []
        self._conflicts: dict[int, str] = {}
        self._refused: set[tuple[int, str, Peer]] = set()
        self._heartbeat_due_s = float("-inf")

    def poll(self, now_s: float) -> None:
        """Read everything that is waiting on every transport."""
        self._now_s = now_s
        for transport in self._transports:
            for peer, data in transport.read(now_s):
                for message in self._parse(transport, peer, data):
                    self._receive(message, transport, peer, now_s)

    def vehicles(self) -> Mapping[int, VehicleStatus]:
        """Newest status by system id."""
        return {
            system_id: replace(
                session.status,
                loss_ratio=self._losses[system_id].ratio,
                latency_s=self._latencies[system_id].latency_s,
                conflict=self._conflicts.get(system_id, ""),
            )
            for system_id, session in self._sessions.items()
        }

    def send(self, safe: SafeSetpoint, now_s: float) -> None:
        """One velocity setpoint over SET_POSITION_TARGET_GLOBAL_INT; yaw always commanded (ArduPilot#22840)."""
        if not safe.passed_gate:
            raise ValueError("only setpoints that passed the safety gate may be sent")
        wish = safe.setpoint
        north, east, down = wish.vel_ned_mps
        yaw_rad = math.remainder(wish.yaw_rad, 2.0 * math.pi)
        if not all(map(math.isfinite, (north, east, down, yaw_rad))):
            raise ValueError(
                f"setpoint for vehicle {wish.system_id} is not finite: {wish.vel_ned_mps}, yaw {wish.yaw_rad}"
            )
        frame = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
        boot_ms = int(now_s * 1e3) & 0xFFFFFFFF
        self._send_to(
            wish.system_id,
            self._codec.set_position_target_global_int_encode(
                boot_ms, wish.system_id, AUTOPILOT_COMPONENT, frame, VELOCITY_AND_YAW,
                0, 0, 0.0, north, east, down, 0.0, 0.0, 0.0, yaw_rad, 0.0,
            ),
        )  # fmt: skip

    def submit(self, command: VehicleCommand, now_s: float) -> CommandTicket:
        """Send an order at the next flush and repeat it until answered."""
        session = self._sessions.get(command.system_id)
        if session is None:
            known = ", ".join(map(str, sorted(self._sessions))) or "none"
            return RefusedTicket(command, f"vehicle {command.system_id} has not been heard; heard so far: {known}")
        return session.submit(command, now_s)

    def flush(self, now_s: float) -> None:
        """Heartbeat once a second, and whatever each session has due."""
        self._now_s = now_s
        if now_s >= self._heartbeat_due_s:
            self._heartbeat_due_s = now_s + HEARTBEAT_S
            self._broadcast(
                self._codec.heartbeat_encode(
                    mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, mavlink.MAV_STATE_ACTIVE
                )
            )
        for system_id, session in self._sessions.items():
            session.flush(now_s, partial(self._send_named, system_id))
            stamp_ns = self._latencies[system_id].request_ns(now_s)
            if stamp_ns is not None:
                self._send_to(system_id, self._codec.timesync_encode(0, stamp_ns))

    def drain_notices(self) -> tuple[str, ...]:
        """What an operator should know about the links, since the last call."""
        notices, self._notices = tuple(self._notices), []
        return notices

    def close(self) -> None:
        """Release all sockets."""
        for transport in self._transports:
            transport.close()

    def _parse(self, transport: Transport, peer: Peer, data: bytes) -> Sequence[Any]:
        parser = self._parsers.get((transport.address, peer))
        if parser is None:
            parser = mavlink.MAVLink(None)
            parser.robust_parsing = True
            self._parsers[(transport.address, peer)] = parser
        return parser.parse_buffer(data) or ()

    def _receive(self, message: Any, transport: Transport, peer: Peer, now_s: float) -> None:
        system_id = message.get_srcSystem()
        if message.get_type() != "BAD_DATA":
            self._record(transport, bytes(message.get_msgbuf()))
        if message.get_type() == "BAD_DATA" or message.get_srcComponent() != AUTOPILOT_COMPONENT:
            return
        if not 1 <= system_id <= MAX_VEHICLE_ID or system_id == OWN_SYSTEM_ID:
            return
        if _is_foreign_heartbeat(message) or not self._admit(system_id, transport, peer, now_s):
            return
        session = self._sessions.get(system_id)
        if session is None:
            if message.get_type() != "HEARTBEAT":
                return
            session = VehicleSession(system_id, transport.address)
            self._sessions[system_id] = session
            self._losses[system_id] = LossMeter()
            self._latencies[system_id] = LatencyMeter()
        self._losses[system_id].on_sequence(message.get_seq())
        if message.get_type() == "TIMESYNC":
            self._on_timesync(message, system_id, now_s)
        if _for_us(message):
            session.receive(message, now_s)

    def _on_timesync(self, message: Any, system_id: int, now_s: float) -> None:
        """An answer to us, or the vehicle's own question, which is answered."""
        if message.tc1 != 0:
            self._latencies[system_id].on_answer(message.ts1, now_s)
        else:
            answer = self._codec.timesync_encode(int(now_s * 1e9) + 1, message.ts1)
            self._send_to(system_id, answer)

    def _admit(self, system_id: int, transport: Transport, peer: Peer, now_s: float) -> bool:
        """Two vehicles with one id both obey (mavlink-router#461): the second is refused, loudly."""
        route = self._routes.get(system_id)
        wanted = self._expected.get(transport.address, system_id)
        elsewhere = route is not None and (route.transport is not transport or route.peer != peer)
        if wanted != system_id:
            self._refuse(system_id, transport, peer, f"expected vehicle {wanted} there")
            return False
        if route is not None and elsewhere and now_s - route.heard_s < CONFLICT_S:
            self._refuse(system_id, transport, peer, f"that id already flies at {route.transport.address}")
            self._conflicts[system_id] = f"a second vehicle at {transport.address} has the same system id; change one"
            return False
        if route is None or elsewhere:
            self._routes[system_id] = _Route(transport, peer, now_s)
        else:
            route.heard_s = now_s
        return True

    def _refuse(self, system_id: int, transport: Transport, peer: Peer, why: str) -> None:
        key = (system_id, transport.address, peer)
        if key not in self._refused:
            self._refused.add(key)
            self._notices.append(
                f"vehicle {system_id} at {transport.address} ({peer[0]}:{peer[1]}) is ignored: {why};"
                " give every vehicle its own system id"
            )

    def _send_named(self, system_id: int, name: str, args: tuple[Any, ...]) -> None:
        encode = getattr(self._codec, f"{name}_encode")
        self._send_to(system_id, encode(system_id, AUTOPILOT_COMPONENT, *args))

    def _send_to(self, system_id: int, message: Any) -> None:
        route = self._routes.get(system_id)
        if route is not None:
            data = self._pack(message)
            self._record(route.transport, data)
            route.transport.write(data, route.peer)

    def _broadcast(self, message: Any) -> None:
        data = self._pack(message)
        for transport in self._transports:
            self._record(transport, data)
            transport.write(data, None)

    def _record(self, transport: Transport, frame: bytes) -> None:
        if self._recorder is not None:
            self._recorder.record(transport.address, self._now_s, frame)

    def _pack(self, message: Any) -> bytes:
        data = bytes(message.pack(self._codec))
        self._codec.seq = (self._codec.seq + 1) % 256
        return data


def _is_foreign_heartbeat(message: Any) -> bool:
    """A gimbal's or companion's heartbeat must not overwrite the vehicle's mode."""
    if message.get_type() != "HEARTBEAT":
        return False
    return message.autopilot == mavlink.MAV_AUTOPILOT_INVALID or message.type in _VEHICLE_TYPES_EXCLUDED


def _for_us(message: Any) -> bool:
    """COMMAND_ACKs for another ground station are not our verdicts; version 1 acks have no target (0)."""
    if message.get_type() != "COMMAND_ACK":
        return True
    return getattr(message, "target_system", 0) in {0, OWN_SYSTEM_ID}
