"""A recorded campaign for people to look at again: what was, slot by slot, and when events fell between them. Pure.

The page replays on the slot clock: position 12.5 is half way through slot 12. Users come as rows without names, which
stand once a page, so that 2,000 users over 120 slots are some 9 MB and not 30.
"""

from collections.abc import Mapping, Sequence
from datetime import datetime
from itertools import pairwise
from typing import Any

import numpy as np

from gcs.api.bodies import View
from gcs.api.schemas import CampaignStatic, EventMessage, MetricsView
from gcs.api.views import metrics_view
from gcs.ports import Severity, SlotRecord
from gcs.store.jsonable import jsonable
from gcs.store.reading import SlotTime
from gcs.store.records import EventRecord

METRE_DIGITS, OTHER_DIGITS = 1, 3
UserRow = tuple[int, float | None, float | None, float, float, bool]
"""Place in ``user_ids``; east and north in m; age of information in slots; waiting data in MB; served in this slot."""


class RecordedEvent(EventMessage):
    """A line of the campaign's log; ``sequence`` is its id there. ``at_slot``: where on the slot clock it fell."""

    at_slot: float


class RecordedUav(View):
    """A UAV at the end of a slot; heading and speed are those flown to get there."""

    system_id: int
    east_m: float | None
    north_m: float | None
    heading_deg: float
    speed_mps: float
    energy_j: float  # used since the campaign's first slot
    active: bool


class RecordedSlot(View):
    """The end of a slot; slot 0 is the start. Metrics are those until then."""

    slot: int
    decision_ms: float | None
    metrics: MetricsView | None
    uavs: list[RecordedUav]
    users: list[UserRow]


class SlotsPage(View):
    """Some slots; ask again with ``first=next_first`` while that is not null."""

    user_ids: list[str]
    slots: list[RecordedSlot]
    next_first: int | None


class RecordingView(View):
    """Everything about a recorded campaign but its slots."""

    campaign: CampaignStatic
    state: str
    reason: str
    begun_at: datetime | None  # None: no slot was recorded
    ended_at: datetime | None
    first_slot: int
    last_slot: int
    battery_j: float  # of a full battery, by the mission
    events: list[RecordedEvent]


def without_files(document: Mapping[str, Any]) -> dict[str, Any]:
    """A mission's document with live users in place of its own, flown by chance: neither needs a file."""
    return {**document, "users": {"source": "live", "count": 1}, "policy": {"name": "random"}}


def recorded_events(events: Sequence[EventRecord], times: Sequence[SlotTime]) -> list[RecordedEvent]:
    """In the log's order, each with its place on the slot clock."""
    places = slot_positions(events, times)
    return [_event(event, place) for event, place in zip(events, places, strict=True)]


def slot_positions(events: Sequence[EventRecord], times: Sequence[SlotTime]) -> list[float]:
    """Between the ends of the slots before and after; before the first and after the last: at them.

    By the flight clock; by the wall clock where a server was started anew in flight, whose clock begins at 0 again.
    """
    if not times:
        return [0.0] * len(events)
    slots = [float(one.slot) for one in times]
    if all(a.time_s < b.time_s for a, b in pairwise(times)):
        then, when = [one.time_s for one in times], [event.time_s for event in events]
    else:
        then = list(np.maximum.accumulate([one.recorded_at.timestamp() for one in times]))
        when = [event.recorded_at.timestamp() for event in events]
    return [round(float(at), 3) for at in np.maximum.accumulate(np.interp(when, then, slots))] if events else []


def slots_page(records: Sequence[SlotRecord], next_first: int | None) -> SlotsPage:
    """Rounded to what a page can show."""
    ids = list(dict.fromkeys(user.user_id for record in records for user in record.users))
    place = {user_id: index for index, user_id in enumerate(ids)}
    return SlotsPage(user_ids=ids, slots=[_slot(record, place) for record in records], next_first=next_first)


def _slot(record: SlotRecord, place: dict[str, int]) -> RecordedSlot:
    uavs = [
        RecordedUav(
            system_id=uav.system_id,
            east_m=_rounded(uav.east_m, METRE_DIGITS),
            north_m=_rounded(uav.north_m, METRE_DIGITS),
            heading_deg=round(uav.heading_deg, OTHER_DIGITS),
            speed_mps=round(uav.speed_mps, OTHER_DIGITS),
            energy_j=round(uav.energy_j, METRE_DIGITS),
            active=uav.active,
        )
        for uav in record.uavs
    ]
    users: list[UserRow] = [
        (
            place[user.user_id],
            _rounded(user.east_m, METRE_DIGITS),
            _rounded(user.north_m, METRE_DIGITS),
            round(user.aoi_slots, OTHER_DIGITS),
            round(user.data_mb, OTHER_DIGITS),
            user.served,
        )
        for user in record.users
    ]
    metrics = metrics_view(record.metrics)
    return RecordedSlot(slot=record.slot, decision_ms=record.decision_ms, metrics=metrics, uavs=uavs, users=users)


def _event(event: EventRecord, at_slot: float) -> RecordedEvent:
    return RecordedEvent(
        sequence=event.id,
        time_s=event.time_s,
        kind=event.kind,
        severity=Severity(event.severity).value,
        message=str(jsonable(event.message)),
        campaign_id=event.campaign_id,
        system_id=event.system_id,
        actor=str(jsonable(event.actor)),
        data=jsonable(event.data),
        at_slot=at_slot,
    )


def _rounded(value: float, digits: int) -> float | None:
    return round(value, digits) if np.isfinite(value) else None
