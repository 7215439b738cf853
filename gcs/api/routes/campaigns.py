"""Campaigns: created, looked at, flown."""

from typing import Annotated, Any

from fastapi import APIRouter, Body, Path, Query, Response
from pydantic import TypeAdapter
from starlette.concurrency import run_in_threadpool

from gcs.api.bodies import CampaignBrief, CampaignFull, PreflightLine, PreflightView, Taken
from gcs.api.campaign_documents import mission_from
from gcs.api.catalog import campaign_static
from gcs.api.context import ApiContext, Context, Who
from gcs.api.flight_requests import ask_or_conflict
from gcs.api.problems import Problem
from gcs.api.views import metrics_view
from gcs.mission.order import FlightSettings
from gcs.mission.preflight import check_fleet, red_lines
from gcs.ports import CampaignSnapshot, CampaignState, OperatorRequest, RequestKind
from gcs.store.keys import Role
from gcs.store.records import TERMINAL, CampaignRecord

router = APIRouter(prefix="/campaigns", tags=["campaigns"])
CampaignId = Annotated[str, Path(min_length=1, max_length=32, pattern="^[A-Za-z0-9_-]+$")]
Document = Annotated[dict[str, Any], Body(openapi_examples={"by name": {"value": {"mission": "demo"}}})]

BRIEFS: TypeAdapter[list[CampaignBrief]] = TypeAdapter(list[CampaignBrief])


@router.post("", status_code=201)
def create(body: Document, context: Context, who: Who) -> CampaignFull:
    """Create from a mission document (JSON of the TOML), or from a mission at hand: ``{"mission": "purdue"}``."""
    mission = mission_from(body)
    record = context.store.campaigns.create(mission, who.name)
    context.catalog.keep(record.id, mission)
    context.audit(who.name, "campaign.created", f'campaign "{record.name}" created', campaign_id=record.id)
    return _full(context, record)


@router.get("", response_model=list[CampaignBrief])
async def newest(
    context: Context,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
    offset: Annotated[int, Query(ge=0, le=10**9)] = 0,
) -> Response:
    """Newest first."""

    def briefs() -> bytes:
        found = context.store.campaigns.newest(limit, offset)
        return BRIEFS.dump_json([CampaignBrief(**_common(context, record)) for record in found])

    flown = context.control.snapshot().campaign
    now = flown and (flown.campaign_id, flown.state, flown.slot, flown.reason, flown.metrics)
    return Response(
        await context.remembered.get(("campaigns", limit, offset, now), briefs), media_type="application/json"
    )


@router.get("/{campaign_id}")
def one(campaign_id: CampaignId, context: Context) -> CampaignFull:
    """State, slot, metrics so far, and the mission as it was given."""
    return _full(context, require(context, campaign_id))


@router.get("/{campaign_id}/preflight")
def preflight(campaign_id: CampaignId, context: Context) -> PreflightView:
    """Every vehicle's checklist for this campaign, with the drones as they are now."""
    scenario = context.catalog.mission(require(context, campaign_id)).scenario
    snapshot = context.control.snapshot()
    vehicles = {vehicle.system_id: vehicle for vehicle in snapshot.vehicles}
    known = context.settings.seats or tuple(sorted(vehicles))  # as a start takes them
    seats = [*known, *[0] * scenario.num_uavs][: scenario.num_uavs]  # 0: a drone that nobody has heard
    lines = check_fleet(scenario, seats, vehicles, snapshot.time_s, FlightSettings().battery_reserve)
    views = [PreflightLine(system_id=x.system_id, check=x.check, grade=x.grade.value, reason=x.reason) for x in lines]
    return PreflightView(ok=not red_lines(lines), lines=views)


@router.post("/{campaign_id}/start", status_code=202)
async def start(campaign_id: CampaignId, context: Context, who: Who, *, override: bool = False) -> Taken:
    """Launch. 409 when it is over, in the air already, another one is, or a pre-flight line is red.

    ``override=true`` takes off in spite of red lines: admins only, and recorded.
    """
    if override and who.role is not Role.ADMIN:
        raise Problem(403, f'overriding the pre-flight checklist needs the role admin, and "{who.name}" is {who.role}')
    record = await run_in_threadpool(require, context, campaign_id)
    state = state_of(context, record)
    if state not in {CampaignState.READY, CampaignState.DRAFT}:
        raise Problem(409, f"campaign {campaign_id} is {state}; only a ready one can be started", state=state)
    mission = await run_in_threadpool(context.catalog.mission, record)
    request = OperatorRequest(RequestKind.START, who.name, campaign_id, mission, override=override)
    return await _taken(context, request, "the campaign is being launched")


@router.post("/{campaign_id}/pause", status_code=202)
async def pause(campaign_id: CampaignId, context: Context, who: Who) -> Taken:
    """Hold in place; the slot clock stops."""
    return await _act(context, RequestKind.PAUSE, campaign_id, who.name, "the drones hold")


@router.post("/{campaign_id}/resume", status_code=202)
async def resume(campaign_id: CampaignId, context: Context, who: Who) -> Taken:
    """Go on after a pause."""
    return await _act(context, RequestKind.RESUME, campaign_id, who.name, "the campaign goes on")


@router.post("/{campaign_id}/abort", status_code=202)
async def abort(campaign_id: CampaignId, context: Context, who: Who) -> Taken:
    """All drones return and land; a campaign that never flew is struck off."""
    record = await run_in_threadpool(require, context, campaign_id)
    if in_flight(context, campaign_id) is None and record.state is CampaignState.READY:
        change = (campaign_id, CampaignState.READY, CampaignState.ABORTED, f"struck off by {who.name}")
        if await run_in_threadpool(context.store.campaigns.set_state, *change):
            context.audit(who.name, "campaign.struck_off", "struck off before it flew", campaign_id=campaign_id)
            return Taken(detail="the campaign is struck off", state=CampaignState.ABORTED)
    return await _act(context, RequestKind.ABORT, campaign_id, who.name, "the drones return and land")


def require(context: ApiContext, campaign_id: str) -> CampaignRecord:
    """The campaign, or 404."""
    record = context.store.campaigns.get(campaign_id)
    if record is None:
        raise Problem(404, f"there is no campaign {campaign_id}; GET /api/v1/campaigns lists them")
    return record


def in_flight(context: ApiContext, campaign_id: str) -> CampaignSnapshot | None:
    """The flight's own word on this campaign, newer than the store's."""
    campaign = context.control.snapshot().campaign
    return campaign if campaign is not None and campaign.campaign_id == campaign_id else None


def state_of(context: ApiContext, record: CampaignRecord) -> CampaignState:
    """By the flight if it has the campaign, else as recorded."""
    flown = in_flight(context, record.id)
    return record.state if flown is None else flown.state


async def _act(context: ApiContext, kind: RequestKind, campaign_id: str, actor: str, done: str) -> Taken:
    record = await run_in_threadpool(require, context, campaign_id)
    state = state_of(context, record)
    if in_flight(context, campaign_id) is None or state in TERMINAL:
        raise Problem(409, f"campaign {campaign_id} is {state} and not in the air: nothing to {kind}", state=state)
    return await _taken(context, OperatorRequest(kind, actor, campaign_id), done)


async def _taken(context: ApiContext, request: OperatorRequest, done: str) -> Taken:
    campaign_id = request.campaign_id
    assert campaign_id is not None
    message = f"{request.kind} asked for{' in spite of red pre-flight lines' if request.override else ''}"
    context.audit(request.actor, f"api.{request.kind}", message, campaign_id=campaign_id)
    await ask_or_conflict(context, request)
    flown = in_flight(context, campaign_id)
    return Taken(detail=done, state=None if flown is None else flown.state)


def _full(context: ApiContext, record: CampaignRecord) -> CampaignFull:
    mission = context.catalog.mission(record)
    static = campaign_static(record.id, mission)
    document = dict(record.document)
    return CampaignFull(**_common(context, record), document=document, static=static, warnings=list(mission.warnings))


def _common(context: ApiContext, record: CampaignRecord) -> dict[str, Any]:
    flown = in_flight(context, record.id)
    if flown is None:
        slot, metrics = context.store.slots.progress(record.id)
    else:
        slot, metrics = flown.slot, flown.metrics
    kept = ("id", "name", "policy", "slots", "slot_s", "user_source", "created_by", "created_at", "updated_at")
    return {name: getattr(record, name) for name in kept} | {
        "state": record.state if flown is None else flown.state,
        "reason": record.reason if flown is None else flown.reason,
        "slot": slot,
        "metrics": metrics_view(metrics),
    }
