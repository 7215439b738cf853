"""What WS /api/v1/stream says, message by message. The page and other clients code against these names.

A client first gets ``hello``. It gets ``campaign`` again whenever another campaign is the one in the air, ``snapshot``
at the rate it asked for (old ones are skipped, never queued), ``event`` for what is worth telling, and ``problem`` when
it said something that the server did not understand. Angles that end in ``_rad`` are clockwise from north.
"""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

Topic = Literal["snapshot", "events"]
RoleName = Literal["viewer", "operator", "admin"]


class Message(BaseModel):
    """Frozen, and strict about names, so that a renamed field is noticed by tests and not by a page."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class MetricsView(Message):
    """The campaign's scores so far (Eq. 5-7); ``user_coverage`` is a fraction of the users."""

    episodic_aoi: float  # slots
    data_collection_ratio: float
    user_coverage: float
    energy_ratio: float
    final_aoi: float  # slots


class ObstacleView(Message):
    """A building; corners in metres east and north of the area's south-west corner."""

    name: str
    height_m: float
    polygon_m: list[tuple[float, float]]


class CampaignStatic(Message):
    """What does not change while a campaign runs."""

    campaign_id: str
    name: str
    policy: str
    user_source: Literal["trace", "walkers", "live"]
    south_west_deg: tuple[float, float]  # latitude, longitude: origin of all metres
    size_m: tuple[float, float]  # east, north
    metres_per_deg: tuple[
        float, float
    ]  # east a degree of longitude, north a degree of latitude, as the server converts
    fence_m: list[tuple[float, float]]  # corners of what the UAVs may not leave
    obstacles: list[ObstacleView]
    launch_m: list[tuple[float, float]]  # one pair a UAV: east, north
    altitude_m: float
    serving_radius_m: float  # horizontal
    max_speed_mps: float
    mcl_db: float
    slots: int
    slot_s: float


class VerdictView(Message):
    """How the newest order to a vehicle ended, with the vehicle's words."""

    command: str
    result: str  # accepted | refused | unsupported | timeout | not_sent
    reason: str
    time_s: float


class VehicleView(Message):
    """A vehicle as last heard; None where it never said. Judge freshness by the ages, not by values changing."""

    system_id: int
    autopilot: str  # px4 | ardupilot | unknown
    mode: str  # guided | takeoff | hold | return | land | pilot | unknown
    mode_name: str  # the autopilot's own word
    armed: bool
    landed: str  # on_ground | in_air | taking_off | landing | unknown
    position_ready: bool
    lat_deg: float | None
    lon_deg: float | None
    east_m: float | None  # None without a campaign, whose area is the origin
    north_m: float | None
    alt_home_m: float | None
    vel_ned_mps: tuple[float, float, float]
    yaw_rad: float  # where the nose points
    heading_deg: float  # direction of travel in [0, 360); the nose's when at rest
    speed_mps: float  # over ground
    battery_fraction: float | None
    return_fraction: float | None  # of a full battery, to fly home and land from here; None without a campaign
    battery_v: float | None
    loss_ratio: float
    heartbeat_age_s: float | None
    position_age_s: float | None
    address: str
    last_verdict: VerdictView | None
    texts: list[str]  # newest STATUSTEXTs, oldest first


class PlanView(Message):
    """What one UAV does in the present slot."""

    system_id: int
    heading_deg: float
    speed_mps: float
    path_m: list[tuple[float, float]]  # east, north, from the slot's start to its end


class UserView(Message):
    """One user at the end of slot ``users_slot``."""

    user_id: str
    east_m: float | None  # None: joined, but no place known yet
    north_m: float | None
    aoi_slots: float
    data_mb: float
    served: bool


class CampaignView(Message):
    """The campaign in the air, or the last one."""

    campaign_id: str
    name: str
    policy: str
    state: str  # ready | launching | flying | paused | recovering | done | aborted | failed
    slot: int
    slots: int
    slot_s: float
    slot_elapsed_s: float
    reason: str
    metrics: MetricsView | None
    plans: list[PlanView]
    users: list[UserView] | None  # only when they changed since the last snapshot sent to this client
    users_slot: int | None  # the slot at whose end the users (sent now or last) stood there
    decision_ms: float | None
    explanation: dict[str, Any]  # why the policy chose this


class SnapshotMessage(Message):
    """Everything that moves."""

    type: Literal["snapshot"] = "snapshot"
    time_s: float  # flight clock, virtual when the flight is faster than real time
    tick: int
    stopped: bool  # emergency stop latched
    healthy: bool  # the flight loop ticks within its deadline
    setpoint_period_s: float | None  # wall clock
    vehicles: list[VehicleView]
    campaign: CampaignView | None


class DeltaMessage(Message):
    """What changed since the last snapshot or delta of this connection, for clients that asked for ``deltas``."""

    type: Literal["delta"] = "delta"
    changed: dict[str, Any]  # fields of the snapshot itself
    vehicles: list[dict[str, Any]]  # ``system_id`` and the fields that changed
    campaign: dict[str, Any]  # fields of the campaign


class EventMessage(Message):
    """Something that happened; ``sequence`` grows by one an event, gaps mean that this client was too slow."""

    type: Literal["event"] = "event"
    sequence: int
    time_s: float
    kind: str  # dotted: campaign.state, command.verdict, plan.late, ...
    severity: Literal["info", "caution", "warning"]
    message: str
    campaign_id: str | None
    system_id: int | None
    actor: str
    data: dict[str, Any]


class HelloMessage(Message):
    """First message of every connection."""

    type: Literal["hello"] = "hello"
    version: str
    role: RoleName
    actor: str  # name of the key, or "loopback" for reading without one
    rate_hz: float  # what the client gets unless it subscribes otherwise
    topics: list[Topic]
    campaign: CampaignStatic | None


class CampaignMessage(Message):
    """Another campaign is in the air than the client was told about."""

    type: Literal["campaign"] = "campaign"
    campaign: CampaignStatic


class ProblemMessage(Message):
    """The client's last message was not understood; the stream goes on as before."""

    type: Literal["problem"] = "problem"
    detail: str


class Subscribe(Message):
    """The only thing a client says: how often, and what."""

    type: Literal["subscribe"]
    rate_hz: float = Field(default=5.0, ge=0.1, le=20.0, allow_inf_nan=False)
    topics: list[Topic] = Field(default=["snapshot", "events"], max_length=2)
    deltas: bool = False  # whole snapshots only when the fleet or the campaign is another one; no explanation


ServerMessage = HelloMessage | CampaignMessage | SnapshotMessage | DeltaMessage | EventMessage | ProblemMessage
