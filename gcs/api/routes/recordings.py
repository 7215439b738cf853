"""A recorded campaign, for the page's replay: its frame and log, and its slots in parts."""

from pathlib import Path
from typing import Annotated

from fastapi import APIRouter, Query

from gcs.api.catalog import campaign_static
from gcs.api.context import ApiContext, Context
from gcs.api.problems import Problem
from gcs.api.recordings import RecordingView, SlotsPage, recorded_events, slots_page, without_files
from gcs.api.routes.campaigns import CampaignId, require, state_of
from gcs.store.records import CampaignRecord
from policy.mission_file import Mission, MissionError, parse_mission

router = APIRouter(prefix="/campaigns/{campaign_id}/recording", tags=["campaigns"])
MAX_EVENTS = 10_000
USER_ROWS = 40_000  # a page: about 1.5 MB


@router.get("")
def recording(campaign_id: CampaignId, context: Context) -> RecordingView:
    """Area, state and log of a campaign with its slots' range; 409 when no slot was recorded."""
    record = require(context, campaign_id)
    times = context.store.slots.times(campaign_id)
    if not times:
        raise Problem(409, f"campaign {campaign_id} has not flown a slot: there is nothing to replay")
    mission = seen_mission(context, record)
    static = campaign_static(record.id, mission)
    events = context.store.events.during(record.id, times[0].recorded_at, times[-1].recorded_at, MAX_EVENTS)
    return RecordingView(
        campaign=static.model_copy(update={"user_source": record.user_source, "policy": record.policy}),
        state=state_of(context, record),
        reason=record.reason,
        begun_at=times[0].recorded_at,
        ended_at=times[-1].recorded_at,
        first_slot=times[0].slot,
        last_slot=times[-1].slot,
        battery_j=mission.scenario.battery_j,
        events=recorded_events(events, times),
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


def seen_mission(context: ApiContext, record: CampaignRecord) -> Mission:
    """The mission as far as a map needs it: a trace or model that is not at hand here is no reason to show nothing."""
    try:
        return context.catalog.mission(record)
    except MissionError:
        directory = None if record.directory is None else Path(record.directory)
        document = without_files(record.document)
        return parse_mission(document, origin=f"campaign {record.id}", directory=directory)
