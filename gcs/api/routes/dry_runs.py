"""Dry runs: an estimate of the four metrics before anything flies."""

from typing import Annotated, Any

from fastapi import APIRouter, Path

from gcs.api.campaign_documents import mission_from
from gcs.api.context import ApiContext, Context, Who
from gcs.api.dry_run_views import DryRunView, dry_run_view
from gcs.api.problems import Problem
from gcs.api.routes.campaigns import CampaignId, Document, require
from gcs.forecast.dry_runs import Busy, DryRun
from gcs.forecast.estimate import DryRunOrder
from gcs.mission.order import FlightSettings, fleet_limits, planning_scenario
from policy.mission_file import Mission

router = APIRouter(tags=["dry runs"])
DryRunId = Annotated[str, Path(min_length=1, max_length=32, pattern="^[a-f0-9]+$")]


@router.post("/dry-runs", status_code=202)
def begin(body: Document, context: Context, who: Who) -> DryRunView:
    """Fly a mission in the world model, in a process of its own: a document or ``{"mission": "purdue"}`` as for
    campaigns, or ``{"campaign": ID}`` for one that exists. 409 while another one is running.
    """
    mission = _mission(context, body)
    if mission.users.kind == "live":
        raise Problem(422, "[users] source: live users cannot be foretold; give the mission a trace or walkers")
    try:
        run = context.dry_runs.start(mission.name, mission.policy, mission.scenario.slots, _order(context, mission))
    except Busy as busy:
        raise Problem(409, f"{busy}; wait for it or DELETE it", dry_run=busy.running.id) from None
    context.audit(who.name, "dry_run.begun", f'dry run of "{mission.name}" with {mission.policy}')
    return dry_run_view(run)


@router.get("/dry-runs")
def newest(context: Context) -> list[DryRunView]:
    """Newest first; the last few are kept until the server ends."""
    return [dry_run_view(run) for run in context.dry_runs.newest()]


@router.get("/dry-runs/{dry_run_id}")
def one(dry_run_id: DryRunId, context: Context) -> DryRunView:
    """How far it is, and the forecast when it is done."""
    return dry_run_view(_found(context.dry_runs.get(dry_run_id), dry_run_id))


@router.delete("/dry-runs/{dry_run_id}")
def cancel(dry_run_id: DryRunId, context: Context, who: Who) -> DryRunView:
    """End it; one that is over stays as it is."""
    return dry_run_view(_found(context.dry_runs.cancel(dry_run_id, f"cancelled by {who.name}"), dry_run_id))


@router.get("/campaigns/{campaign_id}/forecast")
def forecast(campaign_id: CampaignId, context: Context) -> DryRunView:
    """The newest finished dry run of exactly this campaign's mission."""
    record = require(context, campaign_id)
    run = context.dry_runs.forecast_for(dict(record.document))
    if run is None:
        raise Problem(
            404, f'campaign {campaign_id} has no forecast; POST /api/v1/dry-runs {{"campaign": "ID"}} makes one'
        )
    return dry_run_view(run)


def _mission(context: ApiContext, body: dict[str, Any]) -> Mission:
    campaign_id = body.get("campaign")
    if not isinstance(campaign_id, str):  # a mission document has a table of this name
        return mission_from(body)
    if len(body) > 1:
        raise Problem(422, "campaign: stands alone; the campaign's own mission is flown")
    return context.catalog.mission(require(context, campaign_id))


def _order(context: ApiContext, mission: Mission) -> DryRunOrder:
    """With the limits that a flight of the vehicles heard so far would plan with."""
    vehicles = context.control.snapshot().vehicles[: mission.scenario.num_uavs]
    limits = fleet_limits(mission.scenario, [vehicle.limits for vehicle in vehicles])
    scenario = planning_scenario(mission.scenario, limits, FlightSettings())
    directory = None if mission.directory is None else str(mission.directory)
    return DryRunOrder(dict(mission.document), directory, scenario.max_speed_mps, scenario.max_accel_mps2)


def _found(run: DryRun | None, dry_run_id: str) -> DryRun:
    if run is None:
        raise Problem(404, f"there is no dry run {dry_run_id}; GET /api/v1/dry-runs lists them")
    return run
