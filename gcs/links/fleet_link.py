"""A fleet over any MAVLink library: who is heard where, what is believed, what is sent. Never waits."""

import logging
import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Final

from gcs.links.commands import RefusedTicket
from gcs.links.routes import FORGOTTEN_S, Routes
from gcs.links.session import VehicleSession
from gcs.links.status import changed
from gcs.links.uplink import UplinkMeter
from gcs.links.wire import AUTOPILOT_COMPONENT, OWN_SYSTEM_ID, Fields, Heard, Path, Wire
from gcs.ports import CommandTicket, SafeSetpoint, VehicleCommand, VehicleStatus

logger = logging.getLogger(__name__)

HEARTBEAT_S: Final = 1.0
MAX_VEHICLE_ID: Final = 250
OVERRUN_NOTICE_S: Final = 5.0
CONFLICT_S: Final = 5.0  # a vehicle may move to another port after so long a silence
CONFLICT_OVER_S: Final = 10.0  # a second vehicle that is not heard for so long was switched off, or was none
VELOCITY_AND_YAW: Final = 2503  # POSITION_TARGET_TYPEMASK: position, acceleration and yaw rate ignored
RELATIVE_ALT_INT: Final = 6  # MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
_GCS_HEARTBEAT: Final[Fields] = {  # MAV_TYPE_GCS, MAV_AUTOPILOT_INVALID, MAV_STATE_ACTIVE
    "type": 6, "autopilot": 8, "base_mode": 0, "custom_mode": 0, "system_status": 4, "mavlink_version": 3,
}  # fmt: skip
_AUTOPILOT_INVALID: Final = 8
_VEHICLE_TYPES_EXCLUDED: Final = frozenset({5, 6, 18, 26, 27, 30})  # tracker, GCS, companion, gimbal, ADSB, camera

Clock = Callable[[], float]


class WiredFleetLink:
    """:class:`gcs.ports.FleetLink` over a :class:`Wire`.

    ``expected`` maps an address to the system id that must answer there; others there are refused with a notice.
    Several addresses with the same id are several links to one vehicle. ``clock`` tells when messages have been read;
    without one they count as received when they are polled. In real time it matters: a message that comes while a slow
    poll is under way would seem to have come before it left, and every later one of that vehicle too old.
    """

    def __init__(self, wire: Wire, expected: Mapping[str, int] | None = None, clock: Clock | None = None) -> None:
        self._wire, self._expected, self._clock = wire, dict(expected or {}), clock
        self._sessions: dict[int, VehicleSession] = {}
        self._routes: dict[int, Routes] = {}
        self._answered_s: dict[int, float] = {}
        self._uplinks: dict[int, UplinkMeter] = {}
        self._notices: list[str] = []
        self._conflicts: dict[int, tuple[str, float]] = {}  # what is wrong, and when it was seen last
        self._strangers: set[tuple[int, Path]] = set()  # refused, and another vehicle by its time since boot
        self._polled_s = float("-inf")
        self._refused: set[tuple[int, Path]] = set()
        self._heartbeat_due_s = float("-inf")
        self._overrun_due_s = float("-inf")
        self._skipped: dict[str, int] = {}
        self._passed_over: set[tuple[int, str]] = set()

    def poll(self, now_s: float) -> None:
        """Read everything that is waiting."""
        arrived = self._wire.read(now_s)
        received_s = now_s if self._clock is None else self._clock()
        self._polled_s = received_s
        for heard in arrived:
            try:
                self._receive(heard, received_s)
            except Exception:  # whatever one vehicle sends must not end the flight of all
                if self._is_new_trouble(heard):
                    logger.exception("a message was passed over")
        if now_s >= self._overrun_due_s:
            self._tell_overruns(now_s)
            self._notices += self._wire.troubles()

    def _is_new_trouble(self, heard: Heard) -> bool:
        """Told once of each vehicle and kind: it may come fifty times a second."""
        if (heard.system_id, heard.name) in self._passed_over:
            return False
        self._passed_over.add((heard.system_id, heard.name))
        self._notices.append(
            f"vehicle {heard.system_id} at {heard.path.address}: its {heard.name} could not be read and is passed "
            "over; please report this line and the log"
        )
        return True

    def _tell_overruns(self, now_s: float) -> None:
        """Once a while, for each address on which more came than can be read."""
        self._overrun_due_s = now_s + OVERRUN_NOTICE_S
        for address, total in self._wire.skipped().items():
            fresh = total - self._skipped.get(address, 0)
            self._skipped[address] = total
            if fresh:
                self._notices.append(
                    f"{address}: {fresh} datagrams of the last {OVERRUN_NOTICE_S:.0f} s were skipped for newer ones: "
                    "more came than can be read; lower the streams' rates, find who floods the port, or use a faster "
                    "machine"
                )

    def vehicles(self) -> Mapping[int, VehicleStatus]:
        """Newest status by system id."""
        return {system_id: self._status(system_id, session) for system_id, session in self._sessions.items()}

    def _status(self, system_id: int, session: VehicleSession) -> VehicleStatus:
        links = self._routes[system_id].qualities()
        first = links[0]
        return changed(
            session.status,
            loss_ratio=first.loss_ratio,
            latency_s=first.latency_s,
            answered_s=self._answered_s.get(system_id),
            reached_s=self._uplinks[system_id].reached_s,
            silences=self._uplinks[system_id].silences,
            links=links,
            address=first.address,
            conflict=self._conflict(system_id),
        )

    def _conflict(self, system_id: int) -> str:
        """A second vehicle that has been gone for a while is none any more."""
        words, seen_s = self._conflicts.get(system_id, ("", 0.0))
        return words if self._polled_s - seen_s <= CONFLICT_OVER_S else ""

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
        routes = self._routes.get(wish.system_id)
        if routes is None:
            return
        fields = {
            "time_boot_ms": int(now_s * 1e3) & 0xFFFFFFFF,
            "target_system": wish.system_id, "target_component": AUTOPILOT_COMPONENT,
            "coordinate_frame": RELATIVE_ALT_INT, "type_mask": VELOCITY_AND_YAW,
            "lat_int": 0, "lon_int": 0, "alt": 0.0, "vx": north, "vy": east, "vz": down,
            "afx": 0.0, "afy": 0.0, "afz": 0.0, "yaw": yaw_rad, "yaw_rate": 0.0,
        }  # fmt: skip
        self._wire.write("SET_POSITION_TARGET_GLOBAL_INT", fields, routes.usual(now_s), now_s)

    def submit(self, command: VehicleCommand, now_s: float) -> CommandTicket:
        """Send an order at the next flush and repeat it until answered."""
        session = self._sessions.get(command.system_id)
        if session is None:
            known = ", ".join(map(str, sorted(self._sessions))) or "none"
            return RefusedTicket(command, f"vehicle {command.system_id} has not been heard; heard so far: {known}")
        return session.submit(command, now_s)

    def flush(self, now_s: float) -> None:
        """Heartbeat once a second, and whatever each session has due."""
        if now_s >= self._heartbeat_due_s:
            self._heartbeat_due_s = now_s + HEARTBEAT_S
            self._wire.write("HEARTBEAT", _GCS_HEARTBEAT, (), now_s)
        for system_id, session in self._sessions.items():
            session.flush(now_s, partial(self._send_to, system_id, now_s))
            for route in self._routes[system_id].all():
                for stamp_ns in route.latency.requests_ns(now_s):
                    self._timesync(0, stamp_ns, route.path, now_s)

    def drain_notices(self) -> tuple[str, ...]:
        """What an operator should know about the links, since the last call."""
        notices, self._notices = tuple(self._notices), []
        return notices

    def close(self) -> None:
        """Release all sockets."""
        self._wire.close()

    def _receive(self, heard: Heard, now_s: float) -> None:
        system_id = heard.system_id
        if heard.body is None:
            self._note_header(heard, now_s)
            return
        if heard.component_id != AUTOPILOT_COMPONENT or not 1 <= system_id <= MAX_VEHICLE_ID:
            return
        if system_id == OWN_SYSTEM_ID or _is_foreign_heartbeat(heard):
            return
        if not self._admit(system_id, heard, now_s):
            return
        session = self._sessions.get(system_id)
        if session is None:
            session = self._sessions[system_id] = VehicleSession(system_id, heard.path.address)
            self._uplinks[system_id] = UplinkMeter()
        routes = self._routes[system_id]
        counts = routes.note(heard.path, heard.sequence, now_s)
        boot_ms = getattr(heard.body, "time_boot_ms", None)
        if boot_ms is not None and routes.other_vehicle(heard.path, boot_ms / 1e3, now_s):
            words = f"two vehicles answer as {system_id}; give each its own system id"
            self._conflicts[system_id] = (words, now_s)
        if heard.name == "TIMESYNC":
            self._on_timesync(heard, routes, now_s)
        if (counts or heard.name == "COMMAND_ACK") and _for_us(heard):
            session.receive(heard.name, heard.body, now_s)

    def _note_header(self, heard: Heard, now_s: float) -> None:
        """Only a header: it counts for loss."""
        routes = self._routes.get(heard.system_id)
        if routes is not None and heard.component_id == AUTOPILOT_COMPONENT and routes.find(heard.path) is not None:
            routes.note(heard.path, heard.sequence, now_s)

    def _on_timesync(self, heard: Heard, routes: Routes, now_s: float) -> None:
        """An answer to us, or the vehicle's own question, which is answered."""
        if heard.body.tc1 == 0:
            self._timesync(int(now_s * 1e9) + 1, heard.body.ts1, heard.path, now_s)
            return
        route = routes.find(heard.path)
        if route is not None and route.latency.on_answer(heard.body.ts1, now_s):
            self._answered_s[heard.system_id] = now_s
            vehicle_s, asked_s = heard.body.tc1 / 1e9, heard.body.ts1 / 1e9
            self._sessions[heard.system_id].on_time(vehicle_s, asked_s)
            self._uplinks[heard.system_id].on_answer(vehicle_s, asked_s)

    def _timesync(self, tc1: int, ts1: int, path: Path, now_s: float) -> None:
        self._wire.write("TIMESYNC", {"tc1": tc1, "ts1": ts1}, (path,), now_s)

    def _admit(self, system_id: int, heard: Heard, now_s: float) -> bool:
        """Two vehicles with one id both obey (mavlink-router#461): the second is refused, loudly."""
        path = heard.path
        wanted = self._expected.get(path.address)
        if wanted is not None and wanted != system_id:
            self._refuse(system_id, path, f"expected vehicle {wanted} there")
            return False
        routes = self._routes.get(system_id)
        if routes is None:
            if heard.name != "HEARTBEAT":
                return False
            routes = self._routes[system_id] = Routes()
        if routes.find(path) is not None:
            return True
        elsewhere = routes.heard_elsewhere(path, now_s, CONFLICT_S)
        if elsewhere is None and (system_id, path) in self._strangers:
            elsewhere = routes.heard_elsewhere(path, now_s, FORGOTTEN_S)  # the one that fell silent may come back
        if elsewhere is None:
            routes.move(path, now_s)
        elif wanted == system_id and elsewhere.path.address != path.address:
            routes.add(path, now_s)  # a second link that the operator has named
        else:
            self._refuse(system_id, path, f"that id already flies at {elsewhere.path.address}")
            boot_ms = getattr(heard.body, "time_boot_ms", None)
            if boot_ms is not None and routes.is_strange(boot_ms / 1e3, now_s):
                self._strangers.add((system_id, path))
            words = f"a second vehicle at {path.address} has the same system id; change one"
            self._conflicts[system_id] = (words, now_s)
            return False
        return True

    def _refuse(self, system_id: int, path: Path, why: str) -> None:
        if (system_id, path) not in self._refused:
            self._refused.add((system_id, path))
            self._notices.append(
                f"vehicle {system_id} at {path.address} ({path.peer[0]}:{path.peer[1]}) is ignored: {why};"
                " give every vehicle its own system id"
            )

    def _send_to(self, system_id: int, now_s: float, name: str, fields: Fields, *, everywhere: bool = False) -> None:
        routes = self._routes[system_id]
        paths: Sequence[Path] = routes.every(now_s) if everywhere else routes.usual(now_s)
        target: dict[str, Any] = {"target_system": system_id, "target_component": AUTOPILOT_COMPONENT}
        self._wire.write(name, target | dict(fields), paths, now_s)


def _is_foreign_heartbeat(heard: Heard) -> bool:
    """A gimbal's or companion's heartbeat must not overwrite the vehicle's mode."""
    if heard.name != "HEARTBEAT":
        return False
    return heard.body.autopilot == _AUTOPILOT_INVALID or heard.body.type in _VEHICLE_TYPES_EXCLUDED


def _for_us(heard: Heard) -> bool:
    """COMMAND_ACKs for another ground station are not our verdicts; version 1 acks have no target (0)."""
    if heard.name != "COMMAND_ACK":
        return True
    return getattr(heard.body, "target_system", 0) in {0, OWN_SYSTEM_ID}
