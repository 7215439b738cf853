"""A recorded campaign, for the page's replay: its frame and log, and its slots, telemetry and reasons in parts."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, TypeVar

from fastapi import APIRouter, Query

from gcs.api.catalog import campaign_static
from gcs.api.context import ApiContext, Context
from gcs.api.explanations import ExplanationsPage, recorded_decision_view
from gcs.api.problems import Problem
from gcs.api.recorded_clock import Moment, RecordedClock, recorded_clock
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
from gcs.ports import CampaignState
from gcs.store.reading import DecisionMoment, EventFilter, SlotTime
from gcs.store.records import CampaignRecord, EventRecord
from gcs.store.telemetry import SampleTime
from policy.mission_file import Mission, MissionError, parse_mission

router = APIRouter(prefix="/campaigns/{campaign_id}/recording", tags=["campaigns"])
T = TypeVar("T")
MAX_EVENTS = 10_000
USER_ROWS = 40_000  # a page: about 1.5 MB
VEHICLE_ROWS = 8_000  # likewise
REASON_ROWS = 2_000  # likewise


@router.get("")
def recording(campaign_id: CampaignId, context: Context) -> RecordingView:
    """Area, state and log of a campaign with its slots' range; 409 for one that was never started.

    A campaign that ended before its first slot has no slots, and what there is: telemetry of its launch, and the log.
    """
    record = require(context, campaign_id)
    state = state_of(context, record)
    times, samples = context.store.slots.times(campaign_id), context.store.telemetry.times(campaign_id)
    if not (times or samples) and state in {CampaignState.DRAFT, CampaignState.READY}:
        raise Problem(409, f"campaign {campaign_id} was never started: there is nothing to replay")
    mission = seen_mission(context, record)
    static = campaign_static(record.id, mission)
    events, moments = _log(context, record.id, times, samples)
    clock = recorded_clock(times, samples, () if times or samples else events)
    length_s = round(clock.length_s, 2)
    at_s, known = clock.at_s(times), times or moments
    return RecordingView(
        campaign=static.model_copy(update={"user_source": record.user_source, "policy": record.policy}),
        state=state,
        reason=record.reason,
        begun_at=known[0].recorded_at if known else None,
        ended_at=known[-1].recorded_at if known else None,
        begun_at_s=at_s[0] if times else 0.0,
        ended_at_s=at_s[-1] if times else length_s,
        first_slot=times[0].slot if times else None,
        last_slot=times[-1].slot if times else None,
        battery_j=mission.scenario.battery_j,
        length_s=length_s,
        slot_at_s=list(zip((one.slot for one in times), at_s, strict=True)),
        samples=len(samples),
        events=recorded_events(events, times, clock),
    )


def _log(
    context: ApiContext, campaign_id: str, times: Sequence[SlotTime], samples: Sequence[SampleTime]
) -> tuple[Sequence[EventRecord], Sequence[Moment]]:
    """The campaign's events with what happened meanwhile, and the moments between which that is."""
    moments: list[Moment] = sorted((*times, *samples), key=lambda one: one.recorded_at)
    if moments:
        first, last = moments[0].recorded_at, moments[-1].recorded_at
        return context.store.events.during(campaign_id, first, last, MAX_EVENTS), moments
    events = context.store.events.find(EventFilter(campaign_id=campaign_id), MAX_EVENTS)
    return events, events


@router.get("/slots")
def slots(
    campaign_id: CampaignId,
    context: Context,
    first: Annotated[int, Query(ge=0, le=10**6)] = 0,
    limit: Annotated[int, Query(ge=1, le=500)] = 60,
) -> SlotsPage:
    """Slots from number ``first`` on, as many as ``limit`` and the number of users allow."""
    require(context, campaign_id)
    read = partial(context.store.slots.part, campaign_id)
    part, after = _bounded(read, first, limit, lambda one: USER_ROWS // max(1, len(one.users)))
    return slots_page(part, after.slot if after else None)


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
    read = partial(context.store.telemetry.part, campaign_id)
    found, after = _bounded(read, first, limit, lambda one: VEHICLE_ROWS // max(1, len(one[1].vehicles)))
    times, samples = context.store.slots.times(campaign_id), context.store.telemetry.times(campaign_id)
    at_s = recorded_clock(times, samples).at_s(samples) if samples else []
    place = {one.id: at for one, at in zip(samples, at_s, strict=True)}
    part = [(place[when.id], sample) for when, sample in found]
    return telemetry_page(part, scenario.area.frame, scenario.battery_j, after[0].id if after else None)


@router.get("/explanations")
def explanations(
    campaign_id: CampaignId,
    context: Context,
    first: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0,
    limit: Annotated[int, Query(ge=1, le=2_000)] = 500,
) -> ExplanationsPage:
    """Why: decisions that were flown, from one decision's number on, with what the policy told beside each then."""
    require(context, campaign_id)
    read = partial(context.store.checkpoints.decisions_part, campaign_id)
    found, after = _bounded(read, first, limit, lambda one: REASON_ROWS // max(1, len(one.decision.heading_rad)))
    times, samples = context.store.slots.times(campaign_id), context.store.telemetry.times(campaign_id)
    if not (found and (times or samples)):
        return ExplanationsPage(decisions=[], next_first=None)
    clock = recorded_clock(times, samples)
    begin_s = dict(zip((one.slot for one in times), clock.at_s(times), strict=True))
    flown = [one for one in found if one.decision.flown]
    views = [recorded_decision_view(_made_at_s(clock, one, begin_s), one.decision) for one in flown]
    return ExplanationsPage(decisions=views, next_first=after.id if after else None)


def _bounded(
    read: Callable[[int, int], Sequence[T]], first: int, limit: int, most: Callable[[T], int]
) -> tuple[Sequence[T], T | None]:
    """Records from ``first`` on, as many as ``limit`` and (by the first one) ``most`` allow; and the one after."""
    head = read(first, 1)
    count = max(1, min(limit, most(head[0]))) if head else limit
    found = read(first, count + 1)
    return found[:count], found[count] if len(found) > count else None


def _made_at_s(clock: RecordedClock, one: DecisionMoment, begin_s: dict[int, float]) -> float:
    """Into the recording; by the slot that it was made for, where an older version noted no time."""
    if clock.by_wall or math.isfinite(one.time_s):
        return clock.at_s([one])[0]
    return begin_s.get(one.decision.slot, 0.0)


def seen_mission(context: ApiContext, record: CampaignRecord) -> Mission:
    """The mission as far as a map needs it: a trace or model that is not at hand here is no reason to show nothing."""
    try:
        return context.catalog.mission(record)
    except MissionError:
        directory = None if record.directory is None else Path(record.directory)
        document = without_files(record.document)
        return parse_mission(document, origin=f"campaign {record.id}", directory=directory)
