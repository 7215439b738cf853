"""A campaign's report, assembled from its recorded slots and events."""

import json
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
from gcs.report import ReportData, render_page
from gcs.report.document import report_document
from gcs.report.paper_row import paper_rows
from gcs.report.repeat import provenance
from gcs.report.tracks import geojson, kml
from gcs.report.trajectory import trajectory_csv
from gcs.store.decision_documents import without_places
from gcs.store.jsonable import jsonable
from gcs.store.reading import EventFilter
from gcs.store.records import CampaignRecord, EventRecord
from gcs.store.vehicle_rows import telemetry_document

router = APIRouter(prefix="/campaigns/{campaign_id}", tags=["campaigns"])
MAX_EVENTS = 10_000
OTHER_FORMS = "?format=json, csv, geojson or kml of this address; the mission below, saved as mission.toml"
AGAIN = "python -m gcs fly mission.toml --fleet mock --speedup max"  # a stand-in for the real fleet


class ReportFormat(StrEnum):
    """How the report is written."""

    JSON = "json"
    CSV = "csv"
    HTML = "html"
    GEOJSON = "geojson"
    KML = "kml"


@router.get("/report", response_class=Response)
def report(
    campaign_id: CampaignId,
    context: Context,
    format: ReportFormat = ReportFormat.JSON,  # noqa: A002 the contract's name
    places: bool = True,
) -> Response:
    """Metrics, per-slot series and events; CSV as ``--trajectory`` writes it, HTML as one page, GeoJSON and KML tracks.

    ``places=false`` leaves out where users were, which is personal data (all but HTML).
    """
    record = require(context, campaign_id)
    slots = context.store.slots.of(campaign_id)
    if not places and format is ReportFormat.HTML:
        raise Problem(422, "places: an HTML report shows users on its map; ask for another format without places")
    if not places:
        slots = [_without_places(slot) for slot in slots]
    match format:
        case ReportFormat.JSON:
            return JSONResponse(_document(context, record, slots, places=places))
        case ReportFormat.CSV:
            return _file(campaign_id, "csv", "text/csv; charset=utf-8", trajectory_csv(slots))
        case ReportFormat.HTML:
            page = render_page(_report_data(context, record, slots), OTHER_FORMS)
            return HTMLResponse(page, headers={"content-security-policy": REPORT_POLICY})
        case ReportFormat.GEOJSON:
            tracks = json.dumps(geojson(_report_data(context, record, slots), users=places), allow_nan=False)
            return _file(campaign_id, "geojson", "application/geo+json", tracks)
        case ReportFormat.KML:
            marks = kml(_report_data(context, record, slots), users=places)
            return _file(campaign_id, "kml", "application/vnd.google-earth.kml+xml", marks)


def _file(campaign_id: str, suffix: str, media_type: str, text: str) -> Response:
    headers = {"content-disposition": f'attachment; filename="campaign-{campaign_id}.{suffix}"'}
    return Response(text, media_type=media_type, headers=headers)


def _document(context: ApiContext, record: CampaignRecord, slots: Sequence[SlotRecord], *, places: bool) -> object:
    metrics = slots[-1].metrics if slots else None
    decisions = context.store.checkpoints.decision_documents(record.id)
    return jsonable(
        {
            "campaign": {"id": record.id, "name": record.name, "policy": record.policy, "document": record.document},
            "state": state_of(context, record),
            "reason": record.reason,
            "metrics": None if metrics is None else asdict(metrics),
            "slots": [asdict(slot) for slot in slots],
            "telemetry": telemetry_document(context.store.telemetry.rows(record.id)),
            "decisions": decisions if places else [without_places(one) for one in decisions],
            "events": [EventView(**asdict(event)).model_dump(mode="json") for event in _events(context, record)],
        }
        | (_beside(_report_data(context, record, slots)) if slots else {})
    )


def _beside(data: ReportData) -> dict[str, object]:
    """What ``report.json`` of a headless flight also has: the comparison, sums, and how to fly it again."""
    document = report_document(data)
    return {name: document[name] for name in ("comparison", "violations", "uav_totals", "user_totals", "provenance")}


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
        comparison=foretold(context.dry_runs.forecast_for(dict(record.document))) + paper_rows(mission),
        events=events,
        violations=violations_of(events),
        provenance=provenance(
            mission,
            policy=record.policy,
            checkpoint=mission.checkpoint,
            repeat="" if mission.users.kind == "live" else AGAIN,
            seed=0,
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
