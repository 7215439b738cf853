"""Drones: how they are, and orders to them."""

from typing import Annotated

from fastapi import APIRouter, Path, Request, Response
from starlette.concurrency import run_in_threadpool

from gcs.api.bodies import CommandBody, Taken, VerdictBody
from gcs.api.context import ApiContext, Context, Who
from gcs.api.flight_requests import ask, ask_or_conflict
from gcs.api.problems import Problem
from gcs.api.schemas import VehicleView
from gcs.api.stream_source import SnapshotSource
from gcs.api.views import vehicle_view
from gcs.ports import (
    CommandKind,
    OperatorRequest,
    RequestKind,
    Severity,
    VehicleCommand,
    VehicleStatus,
    Verdict,
)
from gcs.store.entries import CommandEntry

router = APIRouter(tags=["drones"])
SystemId = Annotated[int, Path(ge=1, le=255)]


@router.get("/drones", response_model=list[VehicleView])
async def drones(request: Request) -> Response:
    """Every vehicle ever heard, with the age of what is known."""
    source: SnapshotSource = request.app.state.snapshots
    tick = source.newest() if source.at_hand() else await run_in_threadpool(source.newest)
    return Response(tick.vehicles_json, media_type="application/json")


@router.get("/drones/{sysid}")
def drone(sysid: SystemId, context: Context) -> VehicleView:
    """One vehicle."""
    return _view(context, _require(context, sysid))


@router.post("/drones/{sysid}/commands")
async def command(sysid: SystemId, body: CommandBody, context: Context, who: Who) -> VerdictBody:
    """Give an order and wait for the vehicle's own verdict; a refusal by the vehicle is an answer, not an error."""
    _require(context, sysid)
    order = VehicleCommand(CommandKind(body.command), sysid, body.altitude_m, body.force)
    severity = Severity.WARNING if order.kind is CommandKind.TERMINATE or order.force else Severity.INFO
    message = f"{body.command} asked of drone {sysid}{' by force' if body.force else ''}"
    context.audit(who.name, "api.command", message, severity=severity, system_id=sysid, data=body.model_dump())
    request = OperatorRequest(RequestKind.COMMAND, who.name, command=order)
    outcome = await ask(context, request, context.settings.command_timeout_s)
    if outcome.verdict is None:
        raise Problem(409, outcome.reason or f"{body.command} is not possible now")
    context.store.journal.put(CommandEntry(who.name, outcome.verdict))
    return _verdict_body(outcome.verdict)


@router.post("/emergency-stop", status_code=202)
async def emergency_stop(context: Context, who: Who) -> Taken:
    """Every vehicle stops where it is; latched until it is reset."""
    return await _fleet(context, who.name, RequestKind.EMERGENCY_STOP, "emergency stop", "all vehicles stop")


@router.post("/emergency-stop/reset", status_code=202)
async def reset_stop(context: Context, who: Who) -> Taken:
    """Take the latch off."""
    return await _fleet(context, who.name, RequestKind.RESET_STOP, "emergency stop reset", "the stop is taken off")


@router.post("/drones/{sysid}/emergency-stop", status_code=202)
async def emergency_stop_one(sysid: SystemId, context: Context, who: Who) -> Taken:
    """One vehicle stops where it is, latched until it is reset; the others go on."""
    _require(context, sysid)
    message, done = f"emergency stop of drone {sysid}", f"drone {sysid} stops"
    return await _fleet(context, who.name, RequestKind.EMERGENCY_STOP, message, done, sysid)


@router.post("/drones/{sysid}/emergency-stop/reset", status_code=202)
async def reset_stop_one(sysid: SystemId, context: Context, who: Who) -> Taken:
    """Take the latch of one vehicle off."""
    _require(context, sysid)
    message, done = f"emergency stop of drone {sysid} reset", f"the stop of drone {sysid} is taken off"
    return await _fleet(context, who.name, RequestKind.RESET_STOP, message, done, sysid)


async def _fleet(
    context: ApiContext, actor: str, kind: RequestKind, message: str, done: str, system_id: int | None = None
) -> Taken:
    context.audit(actor, f"api.{kind}", message, severity=Severity.WARNING, system_id=system_id)
    await ask_or_conflict(context, OperatorRequest(kind, actor, system_id=system_id))
    return Taken(detail=done)


def _require(context: ApiContext, system_id: int) -> VehicleStatus:
    found = [vehicle for vehicle in context.control.snapshot().vehicles if vehicle.system_id == system_id]
    if not found:
        raise Problem(404, f"no vehicle with system id {system_id} was ever heard; GET /api/v1/drones lists them")
    return found[0]


def _view(context: ApiContext, vehicle: VehicleStatus) -> VehicleView:
    snapshot = context.control.snapshot()
    campaign_id = None if snapshot.campaign is None else snapshot.campaign.campaign_id
    frame = None if campaign_id is None else context.catalog.frame(campaign_id)
    battery_j = None if campaign_id is None else context.catalog.battery_j(campaign_id)
    verdict = context.store.tail.verdicts().get(vehicle.system_id)
    return vehicle_view(vehicle, snapshot.time_s, frame, verdict, battery_j)


def _verdict_body(verdict: Verdict) -> VerdictBody:
    return VerdictBody(
        system_id=verdict.command.system_id,
        command=verdict.command.kind,
        accepted=verdict.accepted,
        result=verdict.result,
        reason=verdict.reason,
        attempts=verdict.attempts,
        duration_s=verdict.duration_s,
    )
