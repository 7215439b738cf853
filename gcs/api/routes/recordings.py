"""A recorded campaign, for the page's replay: its frame and log, and its slots and telemetry in parts."""

from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query

from gcs.api.catalog import campaign_static
from gcs.api.context import ApiContext, Context
from gcs.api.problems import Problem
from gcs.api.recorded_clock import recorded_clock
from gcs.api.recordings import (
    RecordingView,
    SlotsPage,
    TelemetryPage,
    recorded_events,
    slots_page,
    telemetry_page,
    without_files,
)
from gcs.api.routes.campaigns import CampaignId, require, state_of
from gcs.store.records import CampaignRecord
from policy.mission_file import Mission, MissionError, parse_mission

router = APIRouter(prefix="/campaigns/{campaign_id}/recording", tags=["campaigns"])
MAX_EVENTS = 10_000
USER_ROWS = 40_000  # a page: about 1.5 MB
VEHICLE_ROWS = 8_000  # likewise


@router.get("")
def recording(campaign_id: CampaignId, context: Context) -> RecordingView:
    """Area, state and log of a campaign with its slots' range; 409 when no slot was recorded."""
    record = require(context, campaign_id)
    times = context.store.slots.times(campaign_id)
    if not times:
        raise Problem(409, f"campaign {campaign_id} has not flown a slot: there is nothing to replay")
    mission = seen_mission(context, record)
    static = campaign_static(record.id, mission)
    samples = context.store.telemetry.times(campaign_id)
    clock = recorded_clock(times, samples)
    moments = [one.recorded_at for one in times] + [one.recorded_at for one in samples]
    events = context.store.events.during(record.id, min(moments), max(moments), MAX_EVENTS)
    return RecordingView(
        campaign=static.model_copy(update={"user_source": record.user_source, "policy": record.policy}),
        state=state_of(context, record),
        reason=record.reason,
        begun_at=times[0].recorded_at,
        ended_at=times[-1].recorded_at,
        first_slot=times[0].slot,
        last_slot=times[-1].slot,
        battery_j=mission.scenario.battery_j,
        length_s=round(clock.length_s, 2),
        slot_at_s=list(zip((one.slot for one in times), clock.at_s(times), strict=True)),
        samples=len(samples),
        events=recorded_events(events, times, clock),
    )


@router.get("/slots")
def slots(
    campaign_id: CampaignId,
    context: Context,
    first: Annotated[int, Query(ge=0, le=10**6)] = 0,
    limit: Annotated[int, Query(ge=1, le=500)] = 60,
) -> SlotsPage:
    """Slots from number ``first`` on, as many as ``limit`` and the number of users allow."""
    require(context, campaign_id)
    head = context.store.slots.part(campaign_id, first, 1)
    most = max(1, min(limit, USER_ROWS // max(1, len(head[0].users)))) if head else limit
    found = context.store.slots.part(campaign_id, first, most + 1)
    more = found[most].slot if len(found) > most else None
    return slots_page(found[:most], more)


@router.get("/telemetry")
def telemetry(
    campaign_id: CampaignId,
    context: Context,
    first: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0,
    limit: Annotated[int, Query(ge=1, le=2_000)] = 1_000,
) -> TelemetryPage:
    """What all vehicles said, from one sample's number on, as many as ``limit`` and the number of vehicles allow."""
    record = require(context, campaign_id)
    scenario = seen_mission(context, record).scenario
    head = context.store.telemetry.part(campaign_id, first, 1)
    most = max(1, min(limit, VEHICLE_ROWS // max(1, len(head[0][1].vehicles)))) if head else limit
    found = context.store.telemetry.part(campaign_id, first, most + 1)
    times, samples = context.store.slots.times(campaign_id), context.store.telemetry.times(campaign_id)
    at_s = recorded_clock(times, samples).at_s(samples) if samples else []
    place = {one.id: at for one, at in zip(samples, at_s, strict=True)}
    part = [(place[when.id], sample) for when, sample in found[:most]]
    more = found[most][0].id if len(found) > most else None
    return telemetry_page(part, scenario.area.frame, scenario.battery_j, more)


def seen_mission(context: ApiContext, record: CampaignRecord) -> Mission:
    """The mission as far as a map needs it: a trace or model that is not at hand here is no reason to show nothing."""
    try:
        return context.catalog.mission(record)
    except MissionError:
        directory = None if record.directory is None else Path(record.directory)
        document = without_files(record.document)
        return parse_mission(document, origin=f"campaign {record.id}", directory=directory)
