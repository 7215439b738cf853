"""What the rooms of ground control say to each other: values and protocols, no behaviour.

The flight loop is one synchronous thread stepped by a clock (10 Hz); everything in it takes ``now_s``, seconds on
that clock, which may be virtual. Other threads (API, store) read the newest frozen snapshot and leave requests.
"""

import math
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Protocol, runtime_checkable

from policy.agents.base import Decision
from policy.mission_file import Mission
from policy.world.arrays import BoolArray, FloatArray
from policy.world.metrics import Metrics
from policy.world.scenario import Scenario
from policy.world.state import WorldState

# --- vehicles -----------------------------------------------------------------------------------------------------


class FlightMode(StrEnum):
    """What a vehicle's own mode means to us."""

    GUIDED = "guided"  # follows our velocity: PX4 OFFBOARD, ArduPilot GUIDED
    TAKEOFF = "takeoff"
    HOLD = "hold"
    RETURN = "return"
    LAND = "land"
    PILOT = "pilot"  # any mode that a person flies or that we did not ask for
    UNKNOWN = "unknown"


class Landed(StrEnum):
    """MAV_LANDED_STATE."""

    UNKNOWN = "unknown"
    ON_GROUND = "on_ground"
    IN_AIR = "in_air"
    TAKING_OFF = "taking_off"
    LANDING = "landing"


@dataclass(frozen=True)
class VehicleLimits:
    """What the vehicle will really do, read from its parameters; None where it did not say."""

    max_speed_mps: float | None = None
    max_accel_mps2: float | None = None
    setpoint_timeout_s: float | None = None


@dataclass(frozen=True)
class LinkQuality:
    """One way to a vehicle: share of messages lost, round trip by TIMESYNC, and when it was last heard there."""

    address: str
    loss_ratio: float = 0.0
    latency_s: float | None = None
    heard_s: float = 0.0
    primary: bool = False  # what is heard there counts; the others stand by


@dataclass(frozen=True, slots=True)
class Silence:
    """A time in which a vehicle got nothing of ours that we know of: ``length_s`` by its clock; it ended with what we
    sent at ``ended_s`` of ours."""

    length_s: float
    ended_s: float


@dataclass(frozen=True)
class VehicleStatus:
    """The newest of everything a vehicle said. Times are on the flight clock; None: never heard."""

    system_id: int
    autopilot: str = "unknown"  # px4 | ardupilot | unknown
    mode: FlightMode = FlightMode.UNKNOWN
    mode_name: str = ""
    armed: bool = False
    landed: Landed = Landed.UNKNOWN
    position_ready: bool = False  # the vehicle's own flags say that it can fly by position
    lat_deg: float | None = None
    lon_deg: float | None = None
    alt_amsl_m: float | None = None
    alt_home_m: float | None = None
    vel_ned_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_rad: float = 0.0
    home_lat_deg: float | None = None
    home_lon_deg: float | None = None
    battery_fraction: float | None = None
    battery_v: float | None = None
    heartbeat_s: float | None = None  # when last heard
    position_s: float | None = None  # when the newest position was measured
    loss_ratio: float = 0.0
    address: str = ""
    texts: tuple[str, ...] = ()  # newest STATUSTEXTs, oldest first
    limits: VehicleLimits = field(default_factory=VehicleLimits)
    parameters: Mapping[str, float] = field(default_factory=dict)  # those that were asked for and came
    parameters_settled: bool = False  # each has come or was asked for in vain
    parameters_missing: tuple[str, ...] = ()  # those asked for in vain
    conflict: str = ""  # another vehicle uses the same system id
    latency_s: float | None = None  # round trip by TIMESYNC, smoothed
    answered_s: float | None = None  # when it last answered us: the way up works too
    reached_s: float | None = None  # when the newest that it is known to have got of ours was sent
    silences: tuple[Silence, ...] = ()  # of the last seconds, oldest first
    links: tuple[LinkQuality, ...] = ()  # every link to it, the one in use first
    version: str = ""  # of its firmware, such as 1.15.4
    clock_offset_s: float | None = None  # its UTC less ours
    motors_ok: bool = True  # by its own health flags
    satellites_ok: bool = True  # likewise
    wind_mps: float | None = None  # as the vehicle estimates it; None: it does not say


STALE_AFTER_S = 1.0  # PX4's COM_OF_LOSS_T: an older position is no base for a velocity


@dataclass(frozen=True, slots=True)
class UavTrack:
    """Position and velocity east, north, up; altitude above the vehicle's home. ``age_s`` of the fix behind it."""

    system_id: int
    east_m: float
    north_m: float
    alt_home_m: float
    vel_east_mps: float
    vel_north_mps: float
    vel_up_mps: float
    yaw_rad: float
    age_s: float

    @property
    def is_stale(self) -> bool:
        """Too old to steer by."""
        return self.age_s > STALE_AFTER_S

    @property
    def speed_mps(self) -> float:
        """Horizontal speed over ground."""
        return math.hypot(self.vel_east_mps, self.vel_north_mps)


class CommandKind(StrEnum):
    """What an operator or the mission may order."""

    ARM = "arm"
    DISARM = "disarm"
    TAKEOFF = "takeoff"
    GUIDED = "guided"
    HOLD = "hold"
    RETURN = "rtl"
    LAND = "land"
    TERMINATE = "terminate"


@dataclass(frozen=True)
class VehicleCommand:
    """An order to one vehicle; ``altitude_m`` above home for a take-off; ``urgent``: over all its links, fast."""

    kind: CommandKind
    system_id: int
    altitude_m: float | None = None
    force: bool = False
    urgent: bool = False


class VerdictResult(StrEnum):
    """How an order ended."""

    ACCEPTED = "accepted"
    REFUSED = "refused"  # the vehicle said no
    UNSUPPORTED = "unsupported"
    TIMEOUT = "timeout"  # no answer in spite of repeats
    NOT_SENT = "not_sent"  # unknown vehicle, or the safety rules forbid it


@dataclass(frozen=True)
class Verdict:
    """The vehicle's own answer, with its words."""

    command: VehicleCommand
    result: VerdictResult
    reason: str = ""
    attempts: int = 0
    duration_s: float = 0.0

    @property
    def accepted(self) -> bool:
        """The vehicle agreed to do it (not that it has been done)."""
        return self.result is VerdictResult.ACCEPTED


class CommandTicket(Protocol):
    """A sent order; ``verdict`` stays None until it is known."""

    @property
    def verdict(self) -> Verdict | None: ...


@dataclass(frozen=True)
class VelocitySetpoint:
    """A wish of guidance: north, east, down velocity and where the nose points (clockwise from north)."""

    system_id: int
    vel_ned_mps: tuple[float, float, float]
    yaw_rad: float


class SafeSetpoint(Protocol):
    """A setpoint that passed the gate. Only ``gcs.safety.gate`` makes these; links take nothing else."""

    @property
    def setpoint(self) -> VelocitySetpoint: ...

    @property
    def passed_gate(self) -> bool: ...


class FleetLink(Protocol):
    """All vehicles over one or several transports. Never blocks; called by the flight thread only."""

    def poll(self, now_s: float) -> None:
        """Take in everything that has arrived."""

    def vehicles(self) -> Mapping[int, VehicleStatus]:
        """Newest status by system id."""

    def send(self, safe: SafeSetpoint, now_s: float) -> None:
        """Send one velocity setpoint."""

    def submit(self, command: VehicleCommand, now_s: float) -> CommandTicket:
        """Send an order; it is repeated until answered or given up."""

    def flush(self, now_s: float) -> None:
        """Heartbeats, repeats and requests that are due."""

    def drain_notices(self) -> tuple[str, ...]:
        """What an operator should know about the links, since the last call."""

    def close(self) -> None:
        """Release sockets."""


class FlightClock(Protocol):
    """Time of the flight loop; virtual when vehicles and loop share a simulated clock."""

    def now_s(self) -> float: ...

    def wait_until(self, time_s: float) -> None:
        """Return when the clock shows ``time_s`` (a lock-step clock lets the vehicles fly until then)."""

    @property
    def is_virtual(self) -> bool: ...


# --- users, planning, records -------------------------------------------------------------------------------------


class UserPlaces(Protocol):
    """Where people are: by trace, walkers or live fixes. Never answers for a later slot than reached."""

    @property
    def num_users(self) -> int: ...

    def positions(self, sample: int) -> FloatArray:
        """Sample ``sample`` (0 at the campaign's start, t+1 at the end of slot t): [M, 2] east, north metres."""


@runtime_checkable
class LivePlaces(UserPlaces, Protocol):
    """People who report themselves: they join and leave in flight, up to ``num_users``, and may tell of uploads.

    ``positions`` is NaN for rows that nobody has taken yet, and for who left.
    """

    def user_ids(self) -> tuple[str, ...]:
        """Who has ever joined, by row: the first rows of all arrays."""

    def present(self) -> BoolArray:
        """[M] who takes part now."""

    def take_receipts(self) -> tuple[BoolArray, BoolArray]:
        """[M] who uploaded since the last call; [M] who ever sent a receipt: theirs count, not the channel model."""


class PlanTicket(Protocol):
    """A decision under way."""

    def poll(self) -> "Decision | PlanFailure | None":
        """The answer, or None while it is being worked on."""

    def wait(self, timeout_s: float) -> None:
        """Wall-clock wait, for a virtual flight clock only."""

    @property
    def duration_ms(self) -> float | None:
        """Wall-clock time that the decision took; None while it is being worked on."""


@dataclass(frozen=True)
class PlanFailure:
    """The planner failed or answered nonsense; vehicles hold."""

    reason: str


class Planner(Protocol):
    """Decides once a slot, in its own thread or process; never blocks the flight loop."""

    def begin(self, scenario: Scenario, seed: int) -> None:
        """A campaign starts."""

    def request(self, state: WorldState) -> PlanTicket: ...

    def close(self) -> None: ...


class Severity(StrEnum):
    """Warnings need action now, cautions soon (MIL-STD-411F)."""

    INFO = "info"
    CAUTION = "caution"
    WARNING = "warning"


@dataclass(frozen=True)
class Event:
    """Something that happened. ``kind`` is dotted: campaign.state, command.verdict, plan.late, gate.slowed ..."""

    time_s: float  # flight clock
    kind: str
    message: str
    severity: Severity = Severity.INFO
    campaign_id: str | None = None
    system_id: int | None = None
    actor: str = "system"
    data: Mapping[str, Any] = field(default_factory=dict)


class Journal(Protocol):
    """Where events and slots are recorded. Never blocks the flight loop; a slow store is reported, not waited for."""

    def record(self, event: Event) -> None: ...

    def record_slot(self, campaign_id: str, record: "SlotRecord") -> None: ...

    def record_decision(self, campaign_id: str, record: "DecisionRecord") -> None: ...

    def record_setpoints(self, campaign_id: str, slot: int, told: "tuple[SetpointSummary, ...]") -> None:
        """What the UAVs were told on the way to the slot record of this number: 0 is the launch, T + 1 the way home."""

    def record_telemetry(self, campaign_id: str, sample: "TelemetrySample") -> None:
        """What all vehicles say, about once a second, for looking back; a slow store goes without it first."""

    def checkpoint(self, checkpoint: "Checkpoint") -> None:
        """Keep the newest one of its campaign: what a restarted server takes the flight up from."""

    def settle(self) -> bool:
        """Wait until what was recorded so far is durable, some tens of milliseconds at most; False: it is not yet."""

    def durability(self) -> Callable[[], bool]:
        """A question for later: is what was recorded so far durable, so that what follows from it may be told?

        Also true while the store is failing, which is told by itself.
        """


# --- campaign -----------------------------------------------------------------------------------------------------


class CampaignState(StrEnum):
    """States of a campaign; the table of transitions stands in ``gcs.mission.states``."""

    DRAFT = "draft"
    READY = "ready"
    LAUNCHING = "launching"
    FLYING = "flying"
    PAUSED = "paused"
    RECOVERING = "recovering"
    DONE = "done"
    ABORTED = "aborted"
    FAILED = "failed"


@dataclass(frozen=True)
class UavSlot:
    """One UAV at the end of a slot; heading and speed are those flown to get there."""

    system_id: int
    east_m: float
    north_m: float
    heading_deg: float
    speed_mps: float
    energy_j: float  # used since the campaign's first slot
    active: bool = True


@dataclass(frozen=True)
class UserSlot:
    """One user at the end of a slot."""

    user_id: str
    east_m: float
    north_m: float
    aoi_slots: float
    data_mb: float
    served: bool
    active: bool = True  # False: a live user who left; his AoI and data stand still, his place is not kept


@dataclass(frozen=True)
class SlotRecord:
    """The state after ``slot`` slots (0: the start), as in the trajectory file."""

    slot: int
    time_s: float
    uavs: tuple[UavSlot, ...]
    users: tuple[UserSlot, ...]
    metrics: Metrics | None  # so far; None at slot 0
    decision_ms: float | None = None


@dataclass(frozen=True)
class DecisionRecord:
    """A decision with all that it was made from, so that it can be made again (``gcs recheck``).

    One entry a UAV in each tuple: positions and velocities east, north. Users stand in the slot record of the same
    number; ``users`` holds them where they may have changed since (live ones), east, north, Mb, AoI, taking part.
    """

    slot: int
    pos_enu_m: tuple[tuple[float, float], ...]
    vel_enu_mps: tuple[tuple[float, float], ...]
    energy_left_j: tuple[float, ...]
    active: tuple[bool, ...]
    heading_rad: tuple[float, ...]
    speed_mps: tuple[float, ...]
    duration_ms: float | None
    end_heading_rad: tuple[float, ...] | None = None  # at which the slot is to be left, where not as commanded
    end_speed_mps: tuple[float, ...] | None = None
    flown: bool = True  # False: it came too late, and the fleet held
    users: tuple[tuple[float, float, float, float, bool], ...] = ()
    session: str = ""  # one for each time that the policy was begun: at the start and after a restart
    seed: int = 0  # with which it was begun
    max_speed_mps: float = math.nan  # what the plan counted on
    max_accel_mps2: float = math.nan
    time_s: float = math.nan  # flight clock, when the answer was taken
    explanation: Mapping[str, Any] | None = None  # why, as gcs.store.reasons keeps it; None: an older version's record


@dataclass(frozen=True)
class SetpointSummary:
    """What one UAV was told during one slot."""

    system_id: int
    sent: int
    longest_gap_s: float  # between two setpoints, on the flight clock
    top_speed_mps: float  # horizontal, commanded
    slowed: int  # by the gate, see gcs.safety.gate.GateAction
    bent: int
    held: int


@dataclass(frozen=True)
class TelemetrySample:
    """What was known of all vehicles at one moment of the flight clock. A store keeps of it what a page can show."""

    time_s: float
    vehicles: tuple[VehicleStatus, ...]


@dataclass(frozen=True)
class DroneCheckpoint:
    """One drone of a campaign as a restarted server must know it."""

    system_id: int
    control: str  # gcs.mission.drone.Control
    pad_m: tuple[float, float] | None = None  # where it took off, east, north
    active: bool = False
    landed: bool = False


@dataclass(frozen=True)
class Checkpoint:
    """A campaign in the air, beside its slot records; ``slot_elapsed_s`` on the slot clock when it was taken."""

    campaign_id: str
    state: CampaignState
    ending: str  # gcs.mission.states.Trigger
    reason: str
    slot: int  # slots closed
    slot_elapsed_s: float
    max_speed_mps: float  # what the plan counts on, as the vehicles said at the start
    max_accel_mps2: float
    seed: int
    drones: tuple[DroneCheckpoint, ...]


@dataclass(frozen=True)
class UavPlan:
    """What one UAV does in the present slot."""

    system_id: int
    heading_rad: float
    speed_mps: float
    path_enu_m: tuple[tuple[float, float], ...]  # a few points from the slot's start to its end


@dataclass(frozen=True)
class CampaignSnapshot:
    """A campaign as it stands."""

    campaign_id: str
    name: str
    policy: str
    state: CampaignState
    slot: int
    slots: int
    slot_s: float
    slot_elapsed_s: float
    reason: str = ""
    metrics: Metrics | None = None
    plans: tuple[UavPlan, ...] = ()
    latest: SlotRecord | None = None
    decision_ms: float | None = None
    explanation: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class FlightSnapshot:
    """Everything a page needs, built by the flight thread at each tick; safe to read from any thread."""

    time_s: float
    tick: int
    vehicles: tuple[VehicleStatus, ...] = ()
    campaign: CampaignSnapshot | None = None  # the one being flown, or the last one
    stopped: bool = False  # emergency stop latched for all
    stopped_ids: tuple[int, ...] = ()  # drones stopped one by one
    setpoint_period_s: float | None = None  # newest, on the wall clock


class RequestKind(StrEnum):
    """What other threads may ask of the flight thread."""

    START = "start"
    PAUSE = "pause"
    RESUME = "resume"
    ABORT = "abort"
    COMMAND = "command"
    EMERGENCY_STOP = "emergency_stop"
    RESET_STOP = "reset_stop"


@dataclass(frozen=True)
class OperatorRequest:
    """A request with its author, for the audit log."""

    kind: RequestKind
    actor: str
    campaign_id: str | None = None
    mission: Mission | None = None  # with START
    command: VehicleCommand | None = None  # with COMMAND
    override: bool = False  # with START: an admin takes off in spite of red pre-flight lines
    system_id: int | None = None  # with EMERGENCY_STOP and RESET_STOP: this drone only


@dataclass(frozen=True)
class RequestOutcome:
    """Taken up or not, and why; ``verdict`` for commands."""

    accepted: bool
    reason: str = ""
    verdict: Verdict | None = None


class FlightControl(Protocol):
    """The flight thread as seen by the API."""

    def snapshot(self) -> FlightSnapshot: ...

    def submit(self, request: OperatorRequest) -> Future[RequestOutcome]: ...

    def healthy(self) -> bool:
        """The loop ticked within its deadline."""
