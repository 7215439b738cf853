"""A small real fleet in one object: clock, link and point-mass vehicles with modes, in virtual time.

Vehicles behave as the protocol says where it matters to the mission: arming is refused before they are ready, a
PX4 refuses OFFBOARD without a primed stream, an ArduPilot forgets its climb when a velocity comes too early.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from gcs.links.uplink import UplinkMeter
from gcs.ports import (
    Checkpoint,
    CommandKind,
    DecisionRecord,
    Event,
    FlightMode,
    Landed,
    SafeSetpoint,
    SetpointSummary,
    SlotRecord,
    TelemetrySample,
    VehicleCommand,
    VehicleLimits,
    VehicleStatus,
    Verdict,
    VerdictResult,
)
from policy.world.frames import LocalFrame

STEP_S = 0.02
BATTERY_J = 359_640.0


@dataclass
class Ticket:
    verdict: Verdict | None


@dataclass
class FakeVehicle:
    system_id: int
    east_m: float
    north_m: float
    autopilot: str = "px4"
    ready_at_s: float = 2.0
    accel_mps2: float = 4.5
    wind_mps: tuple[float, float] = (0.0, 0.0)
    refuse: dict[CommandKind, str] = field(default_factory=dict)
    refusals: int = 99  # how often it refuses before it gives in
    silent: bool = False  # the link is cut
    deaf: bool = False  # only its way up is cut
    leaves_offboard: bool = False  # as PX4 does: after 1 s without setpoints it is in POSCTL
    motors_ok: bool = True
    satellites_ok: bool = True
    slow_heartbeat: bool = False  # armed shows once a second only, as in a real vehicle's regular heartbeat
    shown_armed: bool = False
    stubborn: int = 0  # so many orders to hold are lost
    alt_m: float = 0.0
    vel: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])  # east, north, up
    armed: bool = False
    mode: FlightMode = FlightMode.HOLD
    mode_name: str = ""  # as the vehicle calls it while in PILOT
    target_alt_m: float = 0.0
    command: tuple[float, float, float] = (0.0, 0.0, 0.0)
    commands: list[CommandKind] = field(default_factory=list)
    setpoint_times_s: list[float] = field(default_factory=list)
    battery_j: float = BATTERY_J
    touched_s: float | None = None
    home: tuple[float, float] = (0.0, 0.0)
    shaped: list[float] = field(default_factory=lambda: [0.0, 0.0])

    def fly(self, now_s: float) -> None:
        self._switch_off_when_down(now_s)
        if self.leaves_offboard and self.mode is FlightMode.GUIDED and now_s - self.setpoint_times_s[-1] > 1.0:
            self.mode, self.mode_name = FlightMode.PILOT, "POSCTL"
        if not self.armed:
            self.vel = [0.0, 0.0, 0.0]
            return
        self.battery_j -= 170.0 * STEP_S
        east, north, up = self._wanted(now_s)
        change = (east - self.shaped[0], north - self.shaped[1])
        size = math.hypot(*change)
        share = min(1.0, self.accel_mps2 * STEP_S / size) if size > 0.0 else 0.0
        self.shaped = [self.shaped[0] + share * change[0], self.shaped[1] + share * change[1]]
        lag = STEP_S / 0.35
        self.vel[0] += lag * (self.shaped[0] + 0.05 * self.wind_mps[0] - self.vel[0])
        self.vel[1] += lag * (self.shaped[1] + 0.05 * self.wind_mps[1] - self.vel[1])
        self.vel[2] += max(-2.5 * STEP_S, min(2.5 * STEP_S, up - self.vel[2]))
        self.east_m += self.vel[0] * STEP_S
        self.north_m += self.vel[1] * STEP_S
        self.alt_m = max(0.0, self.alt_m + self.vel[2] * STEP_S)

    def _switch_off_when_down(self, now_s: float) -> None:
        if self.mode in {FlightMode.LAND, FlightMode.RETURN} and self.armed and self.alt_m <= 0.01:
            self.touched_s = self.touched_s if self.touched_s is not None else now_s
            if now_s - self.touched_s >= 2.0:
                self.armed, self.touched_s = False, None

    def _wanted(self, now_s: float) -> tuple[float, float, float]:
        if self.mode is FlightMode.GUIDED and self.alt_m < 0.5 and self.target_alt_m == 0.0:
            return (0.0, 0.0, 0.0)
        if self.target_alt_m > 0.0:
            if self.alt_m >= self.target_alt_m - 0.3:
                self.target_alt_m = 0.0
                if self.mode is FlightMode.TAKEOFF:
                    self.mode = FlightMode.HOLD
            return (0.0, 0.0, min(5.0, self.target_alt_m - self.alt_m + 0.3))
        if self.mode is FlightMode.GUIDED:
            fresh = self.setpoint_times_s and now_s - self.setpoint_times_s[-1] < 3.0
            return self.command if fresh else (0.0, 0.0, 0.0)
        if self.mode in {FlightMode.LAND, FlightMode.RETURN}:
            east, north = self.home if self.mode is FlightMode.RETURN else (self.east_m, self.north_m)
            if math.hypot(east - self.east_m, north - self.north_m) > 1.0:
                away = math.hypot(east - self.east_m, north - self.north_m)
                share = min(8.0, 0.5 * away) / away
                return (share * (east - self.east_m), share * (north - self.north_m), 0.0)
            return (0.0, 0.0, -1.5 if self.alt_m > 5.0 else -0.7)
        return (0.0, 0.0, 0.0)

    def obey(self, command: VehicleCommand, now_s: float) -> tuple[VerdictResult, str]:
        kind = command.kind
        self.commands.append(kind)
        if kind in self.refuse and self.refusals > 0:
            self.refusals -= 1
            return VerdictResult.REFUSED, self.refuse[kind]
        if kind is CommandKind.ARM:
            if now_s < self.ready_at_s:
                return VerdictResult.REFUSED, "Arm: need position estimate"
            self.armed, self.home = True, (self.east_m, self.north_m)
        elif kind is CommandKind.DISARM:
            if self.alt_m > 0.5:
                return VerdictResult.REFUSED, "in the air"
            self.armed = False
        elif kind is CommandKind.TAKEOFF:
            if not self.armed or (self.autopilot == "ardupilot" and self.mode is not FlightMode.GUIDED):
                return VerdictResult.REFUSED, "takeoff denied"
            self.target_alt_m = command.altitude_m or 0.0
            self.mode = FlightMode.TAKEOFF if self.autopilot == "px4" else FlightMode.GUIDED
        elif kind is CommandKind.GUIDED:
            recent = [t for t in self.setpoint_times_s if now_s - 1.0 <= t]
            primed = bool(self.setpoint_times_s) and now_s - self.setpoint_times_s[0] > 1.0 and len(recent) > 2
            if self.autopilot == "px4" and not primed:
                return VerdictResult.REFUSED, "no offboard signal"
            self.mode = FlightMode.GUIDED
        else:
            self.mode = {
                CommandKind.HOLD: FlightMode.HOLD,
                CommandKind.LAND: FlightMode.LAND,
                CommandKind.RETURN: FlightMode.RETURN,
            }[kind]
        return VerdictResult.ACCEPTED, ""


class FakeFleet:
    """ports.FleetLink and ports.FlightClock over the vehicles."""

    is_virtual = True

    def __init__(self, frame: LocalFrame, vehicles: list[FakeVehicle], *, is_virtual: bool = True) -> None:
        self.frame, self.fleet = frame, {v.system_id: v for v in vehicles}
        self.is_virtual = is_virtual
        self._now_s, self._ticks = 0.0, 0
        self.status: dict[int, VehicleStatus] = {}
        self.sent: list[tuple[float, SafeSetpoint]] = []
        self.flushes = 0
        self.notices: list[str] = []
        self._answered_s: dict[int, float] = {}
        self._uplinks = {vehicle.system_id: UplinkMeter() for vehicle in vehicles}
        self.commands: list[VehicleCommand] = []

    def add(self, vehicle: FakeVehicle) -> None:
        """One more, that nobody may have orders for."""
        self.fleet[vehicle.system_id], self._uplinks[vehicle.system_id] = vehicle, UplinkMeter()

    def now_s(self) -> float:
        return self._now_s

    def wait_until(self, time_s: float) -> None:
        while self._now_s < time_s - 1e-9:
            self._ticks += 1
            self._now_s = self._ticks * STEP_S
            for vehicle in self.fleet.values():
                vehicle.fly(self._now_s)

    def poll(self, now_s: float) -> None:
        for vehicle in self.fleet.values():
            if not vehicle.silent:
                self.status[vehicle.system_id] = self._status(vehicle, now_s)

    def vehicles(self) -> Mapping[int, VehicleStatus]:
        return self.status

    def send(self, safe: SafeSetpoint, now_s: float) -> None:
        assert safe.passed_gate
        self.sent.append((now_s, safe))
        vehicle = self.fleet[safe.setpoint.system_id]
        if vehicle.silent or vehicle.deaf:
            return
        vehicle.setpoint_times_s.append(now_s)
        north, east, down = safe.setpoint.vel_ned_mps
        vehicle.command = (east, north, -down)
        if vehicle.autopilot == "ardupilot" and vehicle.target_alt_m > 0.0:
            vehicle.target_alt_m = 0.0  # measured: a velocity during take-off cancels the climb

    def submit(self, command: VehicleCommand, now_s: float) -> Ticket:
        vehicle = self.fleet[command.system_id]
        self.commands.append(command)
        if vehicle.silent or vehicle.deaf:
            return Ticket(Verdict(command, VerdictResult.TIMEOUT, "", 5, 5.0))
        if command.kind is CommandKind.HOLD and vehicle.stubborn > 0:
            vehicle.stubborn -= 1
            return Ticket(Verdict(command, VerdictResult.TIMEOUT, "", 5, 5.0))
        result, reason = vehicle.obey(command, now_s)
        return Ticket(Verdict(command, result, reason, 1, 0.1))

    def flush(self, now_s: float) -> None:
        self.flushes += 1

    def drain_notices(self) -> tuple[str, ...]:
        notices, self.notices = tuple(self.notices), []
        return notices

    def close(self) -> None:
        self.fleet.clear()

    def _status(self, vehicle: FakeVehicle, now_s: float) -> VehicleStatus:
        if not vehicle.deaf:
            self._answered_s[vehicle.system_id] = now_s
            self._uplinks[vehicle.system_id].on_answer(now_s, now_s)
        if not vehicle.slow_heartbeat or round(now_s / STEP_S) % round(1.0 / STEP_S) == 0:
            vehicle.shown_armed = vehicle.armed
        lat_deg, lon_deg = self.frame.to_geodetic_deg(vehicle.east_m, vehicle.north_m)
        home_lat_deg, home_lon_deg = self.frame.to_geodetic_deg(*vehicle.home)
        return VehicleStatus(
            system_id=vehicle.system_id,
            autopilot=vehicle.autopilot,
            mode=vehicle.mode,
            mode_name=vehicle.mode_name if vehicle.mode is FlightMode.PILOT else vehicle.mode.value.upper(),
            armed=vehicle.shown_armed,
            landed=Landed.ON_GROUND if vehicle.alt_m < 0.1 else Landed.IN_AIR,
            position_ready=now_s >= vehicle.ready_at_s,
            lat_deg=lat_deg,
            lon_deg=lon_deg,
            alt_amsl_m=200.0 + vehicle.alt_m,
            alt_home_m=vehicle.alt_m,
            vel_ned_mps=(vehicle.vel[1], vehicle.vel[0], -vehicle.vel[2]),
            home_lat_deg=home_lat_deg,
            home_lon_deg=home_lon_deg,
            battery_fraction=vehicle.battery_j / BATTERY_J,
            heartbeat_s=now_s,
            position_s=now_s,
            answered_s=self._answered_s.get(vehicle.system_id),
            reached_s=self._uplinks[vehicle.system_id].reached_s,
            silences=self._uplinks[vehicle.system_id].silences,
            motors_ok=vehicle.motors_ok,
            satellites_ok=vehicle.satellites_ok,
            limits=VehicleLimits(18.0, vehicle.accel_mps2, 1.0),
            parameters_settled=True,
        )


@dataclass
class MemoryJournal:
    """ports.Journal in a list."""

    events: list[Event] = field(default_factory=list)
    slots: list[SlotRecord] = field(default_factory=list)
    checkpoints: list[Checkpoint] = field(default_factory=list)
    decisions: list[DecisionRecord] = field(default_factory=list)
    setpoints: dict[int, tuple[SetpointSummary, ...]] = field(default_factory=dict)
    telemetry: list[TelemetrySample] = field(default_factory=list)
    clock: Callable[[], float] = lambda: 0.0  # when a checkpoint is taken
    checkpoint_times_s: list[float] = field(default_factory=list)

    def record(self, event: Event) -> None:
        self.events.append(event)

    def record_slot(self, campaign_id: str, record: SlotRecord) -> None:
        self.slots.append(record)

    def record_decision(self, campaign_id: str, record: DecisionRecord) -> None:
        self.decisions.append(record)

    def record_setpoints(self, campaign_id: str, slot: int, told: tuple[SetpointSummary, ...]) -> None:
        self.setpoints[slot] = told

    def record_telemetry(self, campaign_id: str, sample: TelemetrySample) -> None:
        self.telemetry.append(sample)

    def checkpoint(self, checkpoint: Checkpoint) -> None:
        self.checkpoints.append(checkpoint)
        self.checkpoint_times_s.append(self.clock())

    def settle(self) -> bool:
        return True

    def durability(self) -> Callable[[], bool]:
        return lambda: True

    def kinds(self) -> list[str]:
        return [event.kind for event in self.events]

    def states(self) -> list[str]:
        return [str(event.data["state"]) for event in self.events if event.kind == "campaign.state"]
