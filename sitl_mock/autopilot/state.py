"""The state of one autopilot that its parts share: what is flown, towards what, and what is to be said."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING, Any

from sitl_mock.autopilot import events
from sitl_mock.autopilot.constants import AUTOPILOT_COMPONENT, Landed, Severity
from sitl_mock.autopilot.events import Events
from sitl_mock.autopilot.fence import FenceState
from sitl_mock.autopilot.missions import Store
from sitl_mock.faults.fault import Effects
from sitl_mock.geodesy import Geodetic, to_geodetic
from sitl_mock.wire.signing import Signer

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sitl_mock.autopilot.flavour import Flavour
    from sitl_mock.autopilot.modes import Behaviour, Mode
    from sitl_mock.autopilot.parameters import ParamTable
    from sitl_mock.autopilot.streams import Streams
    from sitl_mock.body import Body, Vec3
    from sitl_mock.physics.vehicle import VehicleType


@dataclass(frozen=True, slots=True)
class VelocityTarget:
    """Velocity to hold; `yaw_rad` None keeps the nose."""

    vel_ned_mps: Vec3
    yaw_rad: float | None = None


@dataclass(frozen=True, slots=True)
class PositionTarget:
    """Place to fly to and hold, metres NED from the pad."""

    pos_ned_m: Vec3
    yaw_rad: float | None = None
    speed_mps: float | None = None


@dataclass(frozen=True, slots=True)
class TakeoffTarget:
    """Climb straight up to `down_m`, lifting off at `lift_off_s`."""

    pos_ned_m: Vec3
    lift_off_s: float


Target = VelocityTarget | PositionTarget | TakeoffTarget


@dataclass(frozen=True, slots=True)
class Note:
    """Something to say: to one peer, or to all (None)."""

    peer: int | None
    name: str
    values: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Later:
    """A command's final verdict that is due at a time."""

    due_s: float
    peer: int
    values: Mapping[str, Any]


@dataclass(slots=True)
class Vehicle:
    """Everything that one autopilot knows. Only the autopilot's own modules change it."""

    system: int
    flavour: Flavour
    airframe: VehicleType
    body: Body
    params: ParamTable
    mode: Mode
    ready_at_s: float
    streams: Streams
    missions: Store = field(default_factory=Store)
    component: int = AUTOPILOT_COMPONENT
    now_s: float = 0.0
    armed: bool = False
    armed_at_s: float = -inf
    touched_down_s: float | None = 0.0  # since when the ground carries it, None in the air
    target: Target | None = None
    setpoint_s: float = -inf  # newest accepted-looking setpoint
    stream_since_s: float = inf  # since when setpoints come without a gap
    home_ned_m: Vec3 = (0.0, 0.0, 0.0)
    stage: str = ""  # of a return, a landing or a mission
    stage_s: float = 0.0
    mission_item: int = 0
    gps_lost_s: float | None = None
    battery_low_s: float | None = None
    battery_stage: int = 0  # 0 good, 1 low, 2 critical: latched
    link_heard_s: float | None = None
    link_lost: bool = False
    params_due: list[tuple[int, int]] = field(default_factory=list)  # peer, next index of its list
    faults: Effects = field(default_factory=Effects)
    fence: FenceState = field(default_factory=FenceState)
    events: Events = field(default_factory=Events)
    signer: Signer = field(default_factory=Signer)
    boot_s: float = 0.0  # simulated time of the last boot
    gained_s: float = 0.0  # what its clock has gained on simulated time
    glitching: bool = False
    motors_told: int = 0
    reboot_due_s: float | None = None
    later: list[Later] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)

    @property
    def clock_s(self) -> float:
        """Time since boot by its own clock: what time stamps show."""
        return max(self.now_s - self.boot_s + self.gained_s, 0.0)

    @property
    def pilot_holds(self) -> bool:
        """Whether the radio's mode switch wins over the ground station."""
        return self.faults.pilot_mode is not None

    @property
    def ready(self) -> bool:
        """Whether the position estimate is good."""
        return self.now_s >= self.ready_at_s and not self.faults.gps_lost

    @property
    def home(self) -> Geodetic:
        """Home on the globe."""
        north, east, down = self.home_ned_m
        return to_geodetic(self.body.pad, north, east, -down)

    @property
    def alt_home_m(self) -> float:
        """Height above home."""
        return self.home_ned_m[2] - self.body.down_m

    @property
    def flying(self) -> bool:
        """Whether it is in the air."""
        return self.touched_down_s is None

    @property
    def landed_state(self) -> Landed:
        """MAV_LANDED_STATE."""
        if not self.flying:
            return Landed.ON_GROUND
        if isinstance(self.target, TakeoffTarget):
            return Landed.TAKEOFF
        return Landed.LANDING if self.stage in {"descend", "touchdown"} else Landed.IN_AIR

    def say(self, severity: Severity, text: str) -> None:
        """STATUSTEXT to everybody."""
        self.notes.append(Note(None, "STATUSTEXT", {"severity": int(severity), "text": text[:50]}))

    def reply(self, peer: int, name: str, **values: Any) -> None:
        """Answers one peer."""
        self.notes.append(Note(peer, name, values))

    def tell(self, peer: int | None, name: str, values: Mapping[str, Any]) -> None:
        """Sends a message to one peer, or to all (None)."""
        self.notes.append(Note(peer, name, values))

    def enter(self, mode: Mode) -> None:
        """Changes the mode; what the old one was doing is forgotten."""
        self.mode, self.target, self.stage, self.stage_s = mode, None, "", self.now_s

    def enter_behaviour(self, behaviour: Behaviour) -> None:
        """Changes to the flavour's mode for a behaviour."""
        mode = self.flavour.modes.doing(behaviour)
        assert mode is not None, f"{self.flavour.name} has no mode for {behaviour}"
        self.enter(mode)

    def arm(self) -> None:
        """Motors on; home is where it stands."""
        self.armed, self.armed_at_s = True, self.now_s
        if not self.flying:
            self.home_ned_m = self.body.pos_ned_m
        events.tell(self, "commander_armed_by")

    def disarm(self, why: str) -> None:
        """Motors off."""
        if self.armed:
            events.tell(self, "commander_disarmed_by")
        self.armed, self.target, self.stage = False, None, ""
        self.say(Severity.INFO, why)
