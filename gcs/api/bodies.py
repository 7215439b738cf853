"""What REST takes and gives, beside the stream's own words."""

from datetime import UTC, datetime
from typing import Annotated, Any, Literal

from pydantic import AwareDatetime, BaseModel, BeforeValidator, ConfigDict, Field

from gcs.api.schemas import CampaignStatic, MetricsView

MAX_BATCH = 10_000
MAX_MESSAGE = 100  # reports in one WebSocket message, which has 16 KiB
Name = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f\x7f]+$")]
Finite = Annotated[float, Field(allow_inf_nan=False)]


def _moment(value: Any) -> Any:
    """Unix seconds become a moment here: pydantic's own guess takes large ones for milliseconds."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return value
    if not 0 <= value <= 253_402_300_799:  # to the end of the year 9999; also refuses NaN
        raise ValueError("should be Unix seconds or an RFC 3339 time with its zone")
    return datetime.fromtimestamp(value, UTC)


Moment = Annotated[AwareDatetime, BeforeValidator(_moment)]


class Body(BaseModel):
    """Unknown members are mistakes."""

    model_config = ConfigDict(extra="forbid")


class MissionByName(Body):
    """A mission at hand (GET /api/v1/missions), if wanted with another policy or model (GET /api/v1/policies)."""

    mission: Name
    policy: Name | None = None
    checkpoint: (
        Annotated[str, Field(min_length=1, max_length=128, pattern=r"^[A-Za-z0-9_-][A-Za-z0-9_.-]*$")] | None
    ) = None


class FixBody(Body):
    """Where a live user was."""

    user: Name
    lat_deg: Annotated[Finite, Field(ge=-90, le=90)]
    lon_deg: Annotated[Finite, Field(ge=-180, le=180)]
    time: Moment
    pending_mb: Annotated[Finite, Field(ge=0, le=1e9)] | None = None


class UploadBody(Body):
    """A receipt: this user's data arrived."""

    user: Name
    time: Moment
    uploaded_mb: Annotated[Finite, Field(ge=0, le=1e9)] | None = None


class CommandBody(Body):
    """An order to one vehicle."""

    command: Literal["arm", "disarm", "takeoff", "hold", "rtl", "land", "terminate"]
    altitude_m: Annotated[Finite, Field(gt=0, le=1000)] | None = None  # above home, with takeoff
    force: bool = False


class DepartureBody(Body):
    """A live user takes no part any more, until a newer fix of his comes."""

    user: Name
    time: Moment


class FixesMessage(Body):
    """Over the WebSocket: fixes; ``number`` comes back with the answer."""

    type: Literal["fixes"]
    number: Annotated[int, Field(ge=0, le=2**53)]
    fixes: Annotated[list[FixBody], Field(min_length=1, max_length=MAX_MESSAGE)]


class UploadsMessage(Body):
    """Over the WebSocket: receipts."""

    type: Literal["uploads"]
    number: Annotated[int, Field(ge=0, le=2**53)]
    uploads: Annotated[list[UploadBody], Field(min_length=1, max_length=MAX_MESSAGE)]


class DeparturesMessage(Body):
    """Over the WebSocket: who left."""

    type: Literal["departures"]
    number: Annotated[int, Field(ge=0, le=2**53)]
    departures: Annotated[list[DepartureBody], Field(min_length=1, max_length=MAX_MESSAGE)]


class KeyBody(Body):
    """A new key."""

    name: Name
    role: Literal["reporter", "viewer", "operator", "admin"]


class View(BaseModel):
    """An answer."""

    model_config = ConfigDict(frozen=True)


class CampaignBrief(View):
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


class CampaignFull(CampaignBrief):
    """One campaign with its document and what the map needs."""

    document: dict[str, Any]
    static: CampaignStatic
    warnings: list[str]


class Taken(View):
    """202: the flight loop took it up."""

    accepted: Literal[True] = True
    detail: str
    state: str | None = None


class PreflightLine(View):
    """One check of one vehicle; ``grade`` ok, caution or red, and only red forbids the start."""

    system_id: int
    check: str
    grade: Literal["ok", "caution", "red"]
    reason: str


class PreflightView(View):
    """The checklist of a campaign's fleet."""

    ok: bool
    lines: list[PreflightLine]


class VerdictBody(View):
    """The vehicle's own answer, with its words."""

    system_id: int
    command: str
    accepted: bool
    result: str  # accepted | refused | unsupported | timeout | not_sent
    reason: str
    attempts: int
    duration_s: float


class FixesTaken(View):
    """202: what became of each fix, counted."""

    accepted: int
    stale: int
    early: int
    outside: int
    full: int


class UploadsTaken(View):
    """202: receipts recorded."""

    accepted: int


class DeparturesTaken(View):
    """202: who left; ``stale`` came after a newer fix of the same user, or of somebody unknown."""

    accepted: int
    stale: int


class MissionView(View):
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


class CheckpointView(View):
    """A trained model at hand, with its provenance card where one lies beside it."""

    file: str
    provenance: dict[str, Any] | None


class PolicyView(View):
    """A policy at hand."""

    name: str
    learned: bool
    checkpoints: list[CheckpointView]


class EventView(View):
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


class EventPage(View):
    """Some of the audit log; ask again with ``after_id=next_after_id`` while that is not null."""

    events: list[EventView]
    next_after_id: int | None


class KeyView(View):
    """A key without its secret."""

    id: str
    name: str
    role: str
    created_at: datetime
    revoked_at: datetime | None


class NewKeyView(KeyView):
    """The only time that the key's text is shown."""

    key: str


class SessionView(View):
    """Who the client is to this server."""

    actor: str
    role: str
    version: str
    open_reading: bool


class Readiness(View):
    """200 when all is well, 503 otherwise; ``problems`` says what is not."""

    ready: bool
    problems: list[str]
    flight_tick: int
    store_queued: int
    store_written: int
    store_lost: int
    store_failures: int


class ProblemDocument(View):
    """RFC 9457, for the documentation; ``gcs.api.problems`` writes them."""

    type: Literal["about:blank"] = "about:blank"
    title: str
    status: int
    detail: str  # what is wrong, where, how to mend it
    instance: str
    errors: list[dict[str, str]] = []  # with 422: where and detail of each
    state: str | None = None  # with 409 on a campaign


class Liveness(View):
    """The process answers."""

    alive: Literal[True] = True
