"""The autopilot: frames and time in, frames out. One instance a vehicle, no socket, no clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sitl_mock.autopilot import failsafe, inbox, missions
from sitl_mock.autopilot.constants import Severity
from sitl_mock.autopilot.guidance import RUN
from sitl_mock.autopilot.inbox import say_param
from sitl_mock.autopilot.missions import Store
from sitl_mock.autopilot.parameters import ParamTable
from sitl_mock.autopilot.state import Note, Vehicle
from sitl_mock.autopilot.streams import Streams
from sitl_mock.autopilot.telemetry import BUILDERS, EPOCH_S, ready
from sitl_mock.physics.fleet import STEP_S, TICK_S
from sitl_mock.wire import Frame, encode
from sitl_mock.wire.signing import SIGNED_FLAG, Signer

if TYPE_CHECKING:
    from sitl_mock.autopilot.flavour import Flavour
    from sitl_mock.body import Body
    from sitl_mock.faults import Effects

_PARAMS_A_TICK = 4  # a full list takes a second or two, as over a real link
_HEARTBEAT_HZ = 1.0
BOOT_S = 2.0  # silent after a reboot


@dataclass(frozen=True, slots=True)
class Outgoing:
    """A frame to send: to one peer, or to every peer of this vehicle (None)."""

    peer: int | None
    data: bytes


class Autopilot:
    """One vehicle's flight controller as its links see it."""

    def __init__(
        self,
        system: int,
        flavour: Flavour,
        body: Body,
        *,
        ready_after_s: float | None = None,
        key: bytes | None = None,
    ) -> None:
        """`ready_after_s` None: as long as the real one's position estimate takes; `key` of 32 bytes signs."""
        first = flavour.modes.by_name(flavour.first_mode)
        assert first is not None, f"{flavour.name}: first mode {flavour.first_mode} is not in its table"
        params = ParamTable(flavour.parameters(body.kind))
        self._silent_until_s = 0.0
        self._ready_after_s = flavour.ready_after_s if ready_after_s is None else ready_after_s
        self._seq = 0
        self._was_ready = False
        self.vehicle = Vehicle(
            system, flavour, body.kind, body, params, first, self._ready_after_s, _streams(flavour), signer=Signer(key)
        )
        self.vehicle.signer.tell_time(EPOCH_S)
        body.set_limits(flavour.limits(params, body.kind))

    def reboot(self) -> None:
        """Starts anew, wherever the vehicle is: motors off, parameters, missions and the signing key are kept."""
        old = self.vehicle
        first = old.flavour.modes.by_name(old.flavour.first_mode)
        assert first is not None
        self._silent_until_s = old.now_s + BOOT_S
        self._was_ready = False
        self.vehicle = Vehicle(
            old.system,
            old.flavour,
            old.airframe,
            old.body,
            old.params,
            first,
            self._silent_until_s + self._ready_after_s,
            _streams(old.flavour, old.now_s),
            missions=Store(dict(old.missions.plans)),
            now_s=old.now_s,
            boot_s=old.now_s,
            faults=old.faults,
            signer=old.signer,
        )
        self.vehicle.body.drive((0.0, 0.0, 0.0), None, motors=False)

    def receive(self, frame: Frame, peer: int, now_s: float) -> None:
        """Takes one frame from a peer. What is meant for another system is ignored."""
        vehicle = self.vehicle
        if now_s < self._silent_until_s:
            return
        vehicle.now_s = max(vehicle.now_s, now_s)
        known = vehicle.signer.accepts(frame.raw, frame.system, frame.component, signed=frame.signed)
        if not known and frame.name not in vehicle.flavour.unsigned:
            return
        inbox.receive(vehicle, frame, peer)

    def tick(self, now_s: float) -> None:
        """A physics step (0.1 s) is about to be taken: failsafes, then the velocity to follow."""
        vehicle = self.vehicle
        vehicle.now_s = now_s
        vehicle.body.advance(now_s)
        vehicle.gained_s += vehicle.faults.clock_rate * STEP_S
        if vehicle.reboot_due_s is not None and now_s >= vehicle.reboot_due_s:
            self.reboot()
        if now_s < self._silent_until_s:
            return
        self._announce()
        failsafe.ground_contact(vehicle)
        failsafe.check(vehicle)
        missions.tick(vehicle)
        self._finish_commands()
        if vehicle.armed:
            drive = RUN[vehicle.mode.behaviour](vehicle)
            vehicle.body.drive(drive.vel_ned_mps, drive.yaw_rad, motors=True)
        else:
            vehicle.body.drive((0.0, 0.0, 0.0), None, motors=False)

    def _announce(self) -> None:
        vehicle = self.vehicle
        if not self._was_ready and vehicle.ready:
            self._was_ready = True
            text = "EKF3 IMU0 is using GPS" if vehicle.flavour.name == "ardupilot" else "Ready for takeoff!"
            vehicle.say(Severity.INFO, text)

    def _finish_commands(self) -> None:
        vehicle = self.vehicle
        for later in [later for later in vehicle.later if later.due_s <= vehicle.now_s + 1e-9]:
            vehicle.later.remove(later)
            vehicle.tell(later.peer, "COMMAND_ACK", later.values)

    def suffer(self, effects: Effects) -> None:
        """What is broken from now on, all faults taken together."""
        before = self.vehicle.faults.pilot_mode
        self.vehicle.faults = effects
        self.vehicle.body.suffer(effects)
        if effects.pilot_mode is not None and effects.pilot_mode != before:
            self._switch_by_radio(effects.pilot_mode)

    def _switch_by_radio(self, name: str) -> None:
        """A pilot takes over with the radio's mode switch; the ground's mode changes are refused."""
        mode = self.vehicle.flavour.modes.by_name(name)
        if mode is None:
            known = ", ".join(self.vehicle.flavour.modes.names)
            raise ValueError(f"{self.vehicle.flavour.name} has no mode {name!r}; it has {known}")
        self.vehicle.enter(mode)

    def collect(self) -> list[Outgoing]:
        """Frames that fall due now, in the order in which they are said."""
        vehicle = self.vehicle
        if vehicle.now_s < self._silent_until_s:
            vehicle.notes.clear()
            return []
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
        vehicle, signer = self.vehicle, self.vehicle.signer
        address = {"system": vehicle.system, "component": vehicle.component, "seq": self._seq}
        if not signer.active:
            return encode(note.name, note.values, **address)
        signer.tell_time(EPOCH_S + vehicle.now_s)
        return signer.sign(encode(note.name, note.values, **address, flags=SIGNED_FLAG))


def _streams(flavour: Flavour, now_s: float = 0.0) -> Streams:
    return Streams({"HEARTBEAT": _HEARTBEAT_HZ, **flavour.default_streams_hz}, TICK_S, now_s)
