"""A campaign's report, assembled from its recorded slots and events."""

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from enum import StrEnum

from fastapi import APIRouter
from fastapi.responses import JSONResponse
from starlette.responses import HTMLResponse, Response

from gcs.api.bodies import EventView
from gcs.api.context import ApiContext, Context
from gcs.api.guards import REPORT_POLICY
from gcs.api.problems import Problem
from gcs.api.report_facts import foretold, violations_of
from gcs.api.routes.campaigns import CampaignId, require, state_of
from gcs.ports import Event, Severity, SlotRecord
from gcs.report import Provenance, ReportData, render_page
from gcs.report.trajectory import trajectory_csv
from gcs.store.jsonable import jsonable
from gcs.store.reading import EventFilter
from gcs.store.records import CampaignRecord, EventRecord

router = APIRouter(prefix="/campaigns/{campaign_id}", tags=["campaigns"])
MAX_EVENTS = 10_000


class ReportFormat(StrEnum):
    """How the report is written."""

    JSON = "json"
    CSV = "csv"
    HTML = "html"


@router.get("/report", response_class=Response)
def report(
    campaign_id: CampaignId,
    context: Context,
    format: ReportFormat = ReportFormat.JSON,  # noqa: A002 the contract's name
    places: bool = True,
) -> Response:
    """Metrics, per-slot series and events; CSV as ``--trajectory`` writes it, HTML as one page.

    ``places=false`` leaves out where users were, which is personal data (JSON and CSV).
    """
    record = require(context, campaign_id)
    slots = context.store.slots.of(campaign_id)
    if not places and format is ReportFormat.HTML:
        raise Problem(422, "places: an HTML report shows users on its map; ask for format=json or csv without places")
    if not places:
        slots = [_without_places(slot) for slot in slots]
    match format:
        case ReportFormat.JSON:
            return JSONResponse(_document(context, record, slots))
        case ReportFormat.CSV:
            headers = {"content-disposition": f'attachment; filename="campaign-{campaign_id}.csv"'}
            return Response(trajectory_csv(slots), media_type="text/csv; charset=utf-8", headers=headers)
        case ReportFormat.HTML:
            page = render_page(_report_data(context, record, slots))
            return HTMLResponse(page, headers={"content-security-policy": REPORT_POLICY})


def _document(context: ApiContext, record: CampaignRecord, slots: Sequence[SlotRecord]) -> object:
    metrics = slots[-1].metrics if slots else None
    return jsonable(
        {
            "campaign": {"id": record.id, "name": record.name, "policy": record.policy, "document": record.document},
            "state": state_of(context, record),
            "reason": record.reason,
            "metrics": None if metrics is None else asdict(metrics),
            "slots": [asdict(slot) for slot in slots],
            "events": [EventView(**asdict(event)).model_dump(mode="json") for event in _events(context, record)],
        }
    )


def _without_places(slot: SlotRecord) -> SlotRecord:
    users = tuple(replace(user, east_m=math.nan, north_m=math.nan) for user in slot.users)
    return replace(slot, users=users)


def _report_data(context: ApiContext, record: CampaignRecord, slots: Sequence[SlotRecord]) -> ReportData:
    if not slots:
        raise Problem(409, f"campaign {record.id} has not flown a slot yet: there is nothing to draw")
    mission = context.catalog.mission(record)
    events = tuple(_event(event) for event in _events(context, record))
    return ReportData(
        name=record.name,
        policy=record.policy,
        scenario=mission.scenario,
        records=tuple(slots),
        comparison=foretold(context.dry_runs.forecast_for(dict(record.document))),
        events=events,
        violations=violations_of(events),
        provenance=Provenance(
            mission=record.document,
            checkpoint=mission.checkpoint or "",
            versions={"gcs": context.settings.version},
            begun_utc=record.created_at.isoformat(timespec="seconds"),
        ),
        state=state_of(context, record),
        reason=record.reason,
    )


def _events(context: ApiContext, record: CampaignRecord) -> Sequence[EventRecord]:
    return context.store.events.find(EventFilter(campaign_id=record.id), MAX_EVENTS)


def _event(record: EventRecord) -> Event:
    values = asdict(record)
    kept = ("time_s", "kind", "message", "campaign_id", "system_id", "actor", "data")
    return Event(**{name: values[name] for name in kept}, severity=Severity(record.severity))
