"""The autopilot: frames and time in, frames out. One instance a vehicle, no socket, no clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sitl_mock.autopilot import failsafe, inbox, missions
from sitl_mock.autopilot.constants import Severity
from sitl_mock.autopilot.guidance import RUN
from sitl_mock.autopilot.inbox import say_param
from sitl_mock.autopilot.parameters import ParamTable
from sitl_mock.autopilot.state import Faults, Note, Vehicle
from sitl_mock.autopilot.streams import Streams
from sitl_mock.autopilot.telemetry import BUILDERS, ready
from sitl_mock.physics.fleet import TICK_S
from sitl_mock.wire import Frame, encode

if TYPE_CHECKING:
    from sitl_mock.autopilot.flavour import Flavour
    from sitl_mock.body import Body

_PARAMS_A_TICK = 4  # a full list takes a second or two, as over a real link
_HEARTBEAT_HZ = 1.0


@dataclass(frozen=True, slots=True)
class Outgoing:
    """A frame to send: to one peer, or to every peer of this vehicle (None)."""

    peer: int | None
    data: bytes


class Autopilot:
    """One vehicle's flight controller as its links see it."""

    def __init__(self, system: int, flavour: Flavour, body: Body, *, ready_after_s: float | None = None) -> None:
        """`ready_after_s` None: as long as the real one's position estimate takes."""
        first = flavour.modes.by_name(flavour.first_mode)
        assert first is not None, f"{flavour.name}: first mode {flavour.first_mode} is not in its table"
        params = ParamTable(flavour.parameters(body.kind))
        ready_at_s = flavour.ready_after_s if ready_after_s is None else ready_after_s
        streams = Streams({"HEARTBEAT": _HEARTBEAT_HZ, **flavour.default_streams_hz}, TICK_S)
        self.vehicle = Vehicle(system, flavour, body.kind, body, params, first, ready_at_s, streams)
        self._seq = 0
        self._was_ready = False
        body.set_limits(flavour.limits(params, body.kind))

    def receive(self, frame: Frame, peer: int, now_s: float) -> None:
        """Takes one frame from a peer. What is meant for another system is ignored."""
        vehicle = self.vehicle
        vehicle.now_s = max(vehicle.now_s, now_s)
        inbox.receive(vehicle, frame, peer)

    def tick(self, now_s: float) -> None:
        """A physics step (0.1 s) is about to be taken: failsafes, then the velocity to follow."""
        vehicle = self.vehicle
        vehicle.now_s = now_s
        if not self._was_ready and vehicle.ready:
            self._was_ready = True
            text = "EKF3 IMU0 is using GPS" if vehicle.flavour.name == "ardupilot" else "Ready for takeoff!"
            vehicle.say(Severity.INFO, text)
        failsafe.ground_contact(vehicle)
        failsafe.check(vehicle)
        missions.tick(vehicle)
        if vehicle.armed:
            drive = RUN[vehicle.mode.behaviour](vehicle)
            vehicle.body.drive(drive.vel_ned_mps, drive.yaw_rad, motors=True)
        else:
            vehicle.body.drive((0.0, 0.0, 0.0), None, motors=False)

    def switch_by_radio(self, name: str) -> None:
        """A pilot takes over with the radio's mode switch; the ground's mode changes are refused."""
        mode = self.vehicle.flavour.modes.by_name(name)
        if mode is None:
            known = ", ".join(self.vehicle.flavour.modes.names)
            raise ValueError(f"{self.vehicle.flavour.name} has no mode {name!r}; it has {known}")
        self.vehicle.faults.pilot_holds = True
        self.vehicle.enter(mode)

    @property
    def faults(self) -> Faults:
        """What is broken; the fault script flips these."""
        return self.vehicle.faults

    def collect(self) -> list[Outgoing]:
        """Frames that fall due now, in the order in which they are said."""
        vehicle = self.vehicle
        for peer, at in vehicle.params_due[:1]:
            for param in list(vehicle.params)[at : at + _PARAMS_A_TICK]:
                say_param(vehicle, param, peer)
            rest = [(peer, at + _PARAMS_A_TICK)] if at + _PARAMS_A_TICK < len(vehicle.params) else []
            vehicle.params_due = vehicle.params_due[1:] + rest
        for name in vehicle.streams.due(vehicle.now_s):
            if ready(vehicle, name):
                vehicle.notes.append(Note(None, name, BUILDERS[name](vehicle)))
        if not vehicle.notes:
            return []
        out = [Outgoing(note.peer, self._encode(note)) for note in vehicle.notes]
        vehicle.notes.clear()
        return out

    def _encode(self, note: Note) -> bytes:
        self._seq = (self._seq + 1) & 0xFF
        vehicle = self.vehicle
        return encode(note.name, note.values, system=vehicle.system, component=vehicle.component, seq=self._seq)
