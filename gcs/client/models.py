"""What the server answers, as types. Written by ``gcs/client/write_models.py``; do not change by hand."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict


class Answer(BaseModel):
    """Frozen; fields that a newer server adds are passed over."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Acknowledged(Answer):
    """By whom."""

    sequence: int
    by: str


class AlternativeView(Answer):
    """A move that was considered for this slot; ``worse_by`` in the price's own unit, 0 for as good."""

    heading_deg: float
    speed_mps: float
    value: float
    worse_by: float


class Baseline(Answer):
    """What another policy scored under the same conditions."""

    policy: str
    metrics: MetricsView


class CampaignBrief(Answer):
    """A campaign in the list."""

    id: str
    name: str
    policy: str
    state: str
    reason: str
    slot: int
    slots: int
    slot_s: float
    user_source: str
    created_by: str
    created_at: datetime
    updated_at: datetime
    metrics: MetricsView | None


class CampaignFull(Answer):
    """One campaign with its document and what the map needs."""

    id: str
    name: str
    policy: str
    state: str
    reason: str
    slot: int
    slots: int
    slot_s: float
    user_source: str
    created_by: str
    created_at: datetime
    updated_at: datetime
    metrics: MetricsView | None
    document: dict[str, Any]
    static: CampaignStatic
    warnings: list[str]


class CampaignStatic(Answer):
    """What does not change while a campaign runs."""

    campaign_id: str
    name: str
    policy: str
    user_source: Literal["trace", "walkers", "live"]
    south_west_deg: tuple[float, float]
    size_m: tuple[float, float]
    metres_per_deg: tuple[float, float]
    fence_m: list[tuple[float, float]]
    obstacles: list[ObstacleView]
    launch_m: list[tuple[float, float]]
    altitude_m: float
    serving_radius_m: float
    max_speed_mps: float
    mcl_db: float
    slots: int
    slot_s: float


class CheckpointView(Answer):
    """A trained model at hand, with its provenance card where one lies beside it."""

    file: str
    provenance: dict[str, Any] | None


class DeparturesTaken(Answer):
    """202: who left; ``stale`` came after a newer fix of the same user, or of somebody unknown."""

    accepted: int
    stale: int


class DryRunView(Answer):
    """A dry run as it stands."""

    id: str
    name: str
    policy: str
    state: str
    slot: int
    slots: int
    reason: str
    forecast: Forecast | None


class EventPage(Answer):
    """Some of the audit log; ask again with ``after_id=next_after_id`` while that is not null."""

    events: list[EventView]
    next_after_id: int | None


class EventView(Answer):
    """A line of the audit log."""

    id: int
    recorded_at: datetime
    time_s: float
    kind: str
    severity: str
    message: str
    campaign_id: str | None
    system_id: int | None
    actor: str
    data: dict[str, Any]


class ExplanationView(Answer):
    """The newest decision. ``value``: the plan's price (lower is better), None where the policy has none."""

    campaign_id: str
    policy: str
    slot: int
    value: float | None
    predicted_gain: float | None
    horizon_slots: int | None
    uavs: list[UavExplanation]


class ExplanationsPage(Answer):
    """Some decisions; ask again with ``first=next_first`` while that is not null."""

    decisions: list[RecordedDecision]
    next_first: int | None


class FixesTaken(Answer):
    """202: what became of each fix, counted."""

    accepted: int
    stale: int
    early: int
    outside: int
    full: int


class Forecast(Answer):
    """What the campaign would score with these limits of the vehicles, flown in the world model without wind."""

    policy: str
    metrics: MetricsView
    baseline: Baseline
    series: list[SeriesPoint]
    decision_ms: dict[str, float]
    violations: dict[str, int]
    energy_left: list[float]
    max_speed_mps: float
    max_accel_mps2: float


class KeyView(Answer):
    """A key without its secret."""

    id: str
    name: str
    role: str
    created_at: datetime
    revoked_at: datetime | None


class Liveness(Answer):
    """The process answers."""

    alive: Literal[True] = True


class MapView(Answer):
    """``url`` has {z}, {x}, {y} with tiles, is this server's file with pmtiles, and is null with none."""

    kind: Literal["none", "tiles", "pmtiles"]
    url: str | None
    attribution: str


class MetricsView(Answer):
    """The campaign's scores so far (Eq. 5-7); ``user_coverage`` is a fraction of the users."""

    episodic_aoi: float
    data_collection_ratio: float
    user_coverage: float
    energy_ratio: float
    final_aoi: float


class MissionView(Answer):
    """A mission at hand; ``error`` when its file cannot be flown."""

    name: str
    title: str | None = None
    policy: str | None = None
    uavs: int | None = None
    slots: int | None = None
    slot_s: float | None = None
    user_source: str | None = None
    warnings: list[str] = []
    error: str | None = None


class NewKeyView(Answer):
    """The only time that the key's text is shown."""

    id: str
    name: str
    role: str
    created_at: datetime
    revoked_at: datetime | None
    key: str


class ObstacleView(Answer):
    """A building; corners in metres east and north of the area's south-west corner."""

    name: str
    height_m: float
    polygon_m: list[tuple[float, float]]


class PolicyView(Answer):
    """A policy at hand."""

    name: str
    learned: bool
    checkpoints: list[CheckpointView]


class PreflightLine(Answer):
    """One check of one vehicle; ``grade`` ok, caution or red, and only red forbids the start."""

    system_id: int
    check: str
    grade: Literal["ok", "caution", "red"]
    reason: str


class PreflightView(Answer):
    """The checklist of a campaign's fleet."""

    ok: bool
    lines: list[PreflightLine]


class Readiness(Answer):
    """200 when all is well, 503 otherwise; ``problems`` says what is not."""

    ready: bool
    problems: list[str]
    flight_tick: int
    store_queued: int
    store_written: int
    store_lost: int
    store_failures: int


class RecordedDecision(Answer):
    """A decision that was flown, and what the policy told beside it then."""

    at_s: float
    slot: int
    duration_ms: float | None
    moves: list[tuple[float, float]]
    told: Literal["reasons", "unknown", "failed", "wiped"]
    note: str
    value: float | None
    predicted_gain: float | None
    horizon_slots: int | None
    uavs: list[RecordedReasons]


class RecordedEvent(Answer):
    """A line of the campaign's log; ``sequence`` is its id there. ``at_slot``: where on the slot clock it fell."""

    type: Literal["event"] = "event"
    sequence: int
    time_s: float
    kind: str
    severity: Literal["info", "caution", "warning"]
    message: str
    campaign_id: str | None
    system_id: int | None
    actor: str
    data: dict[str, Any]
    at_slot: float
    at_s: float


class RecordedReasons(Answer):
    """One UAV's share of a recorded decision; ``uav`` is a row of the slot's UAVs."""

    uav: int
    path_m: list[tuple[float, float]]
    alternatives: list[AlternativeView]
    relations: list[RecordedRelation]


class RecordedRelation(Answer):
    """As :class:`RelationView`; ``user`` is a row of the slot's users, so that who was wiped there has no name here."""

    user: int
    weight: float
    expected_m: tuple[float, float] | None


class RecordedSample(Answer):
    """What was known of all vehicles at one moment, a row each."""

    at_s: float
    vehicles: list[list[Any]]


class RecordedSlot(Answer):
    """The end of a slot; slot 0 is the start. Metrics are those until then."""

    slot: int
    decision_ms: float | None
    metrics: MetricsView | None
    uavs: list[RecordedUav]
    users: list[tuple[int, float | None, float | None, float, float, bool]]


class RecordedUav(Answer):
    """A UAV at the end of a slot; heading and speed are those flown to get there."""

    system_id: int
    east_m: float | None
    north_m: float | None
    heading_deg: float
    speed_mps: float
    energy_j: float
    active: bool


class RecordingView(Answer):
    """Everything about a recorded campaign but its slots and telemetry."""

    campaign: CampaignStatic
    state: str
    reason: str
    begun_at: datetime | None
    ended_at: datetime | None
    begun_at_s: float
    ended_at_s: float
    first_slot: int | None
    last_slot: int | None
    battery_j: float
    length_s: float
    slot_at_s: list[tuple[int, float]]
    samples: int
    events: list[RecordedEvent]


class RelationView(Answer):
    """How much this UAV attends to a user (Eq. 11d), greatest first; ``expected_m``: the forecast of the slot's end."""

    user_id: str
    weight: float
    expected_m: tuple[float, float] | None


class SeriesPoint(Answer):
    """The end of one slot: metrics over all slots until then, the users' mean AoI at that moment."""

    slot: int
    metrics: MetricsView
    mean_aoi_slots: float | None
    decision_ms: float | None


class SessionView(Answer):
    """Who the client is to this server."""

    actor: str
    role: str
    version: str
    open_reading: bool


class SlotsPage(Answer):
    """Some slots; ask again with ``first=next_first`` while that is not null."""

    user_ids: list[str]
    slots: list[RecordedSlot]
    next_first: int | None


class Taken(Answer):
    """202: the flight loop took it up."""

    accepted: Literal[True] = True
    detail: str
    state: str | None = None


class TelemetryPage(Answer):
    """Some samples; ask again with ``first=next_first`` while that is not null. ``columns``: what the rows hold."""

    columns: list[str]
    samples: list[RecordedSample]
    next_first: int | None


class UavExplanation(Answer):
    """One UAV's share of the decision; lists are empty where the policy does not tell."""

    system_id: int
    path_m: list[tuple[float, float]]
    alternatives: list[AlternativeView]
    relations: list[RelationView]


class UploadsTaken(Answer):
    """202: receipts recorded."""

    accepted: int


class VehicleView(Answer):
    """A vehicle as last heard; None where it never said. Judge freshness by the ages, not by values changing."""

    system_id: int
    autopilot: str
    mode: str
    mode_name: str
    armed: bool
    landed: str
    position_ready: bool
    lat_deg: float | None
    lon_deg: float | None
    east_m: float | None
    north_m: float | None
    alt_home_m: float | None
    vel_ned_mps: tuple[float, float, float]
    yaw_rad: float
    heading_deg: float
    speed_mps: float
    battery_fraction: float | None
    return_fraction: float | None
    battery_v: float | None
    loss_ratio: float
    heartbeat_age_s: float | None
    position_age_s: float | None
    address: str
    last_verdict: VerdictView | None
    texts: list[str]


class VerdictBody(Answer):
    """The vehicle's own answer, with its words."""

    system_id: int
    command: str
    accepted: bool
    result: str
    reason: str
    attempts: int
    duration_s: float


class VerdictView(Answer):
    """How the newest order to a vehicle ended, with the vehicle's words."""

    command: str
    result: str
    reason: str
    time_s: float


class CampaignMessage(Answer):
    """Another campaign is in the air than the client was told about."""

    type: Literal["campaign"] = "campaign"
    campaign: CampaignStatic


class CampaignView(Answer):
    """The campaign in the air, or the last one."""

    campaign_id: str
    name: str
    policy: str
    state: str
    slot: int
    slots: int
    slot_s: float
    slot_elapsed_s: float
    reason: str
    metrics: MetricsView | None
    plans: list[PlanView]
    users: list[UserView] | None
    users_slot: int | None
    decision_ms: float | None
    explanation: dict[str, Any]


class DeltaMessage(Answer):
    """What changed since the last snapshot or delta of this connection, for clients that asked for ``deltas``."""

    type: Literal["delta"] = "delta"
    changed: dict[str, Any]
    vehicles: list[dict[str, Any]]
    campaign: dict[str, Any]


class EventMessage(Answer):
    """Something that happened; ``sequence`` grows by one an event, gaps mean that this client was too slow."""

    type: Literal["event"] = "event"
    sequence: int
    time_s: float
    kind: str
    severity: Literal["info", "caution", "warning"]
    message: str
    campaign_id: str | None
    system_id: int | None
    actor: str
    data: dict[str, Any]


class HelloMessage(Answer):
    """First message of every connection."""

    type: Literal["hello"] = "hello"
    version: str
    role: Literal["viewer", "operator", "admin"]
    actor: str
    rate_hz: float
    topics: list[Literal["snapshot", "events"]]
    campaign: CampaignStatic | None


class PlanView(Answer):
    """What one UAV does in the present slot."""

    system_id: int
    heading_deg: float
    speed_mps: float
    path_m: list[tuple[float, float]]


class ProblemMessage(Answer):
    """The client's last message was not understood; the stream goes on as before."""

    type: Literal["problem"] = "problem"
    detail: str


class SnapshotMessage(Answer):
    """Everything that moves."""

    type: Literal["snapshot"] = "snapshot"
    time_s: float
    tick: int
    stopped: bool
    stopped_ids: list[int]
    healthy: bool
    setpoint_period_s: float | None
    vehicles: list[VehicleView]
    campaign: CampaignView | None


class UserView(Answer):
    """One user at the end of slot ``users_slot``."""

    user_id: str
    east_m: float | None
    north_m: float | None
    aoi_slots: float
    data_mb: float
    served: bool
