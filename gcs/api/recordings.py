"""A recorded campaign for people to look at again: users slot by slot, vehicles about once a second, and the log. Pure.

``at_s`` of everything is on one axis (gcs.api.recorded_clock). Users come as rows without names, which stand once a
page, so that 2,000 users over 120 slots are some 9 MB and not 30; so do vehicles.
"""

from collections.abc import Mapping, Sequence
from datetime import datetime
from itertools import pairwise
from typing import Any

import numpy as np

from gcs.api.bodies import View
from gcs.api.recorded_clock import RecordedClock
from gcs.api.schemas import CampaignStatic, EventMessage, MetricsView
from gcs.api.views import metrics_view, vehicle_view
from gcs.ports import Severity, SlotRecord, TelemetrySample
from gcs.store.jsonable import jsonable
from gcs.store.reading import SlotTime
from gcs.store.records import EventRecord
from policy.world.frames import LocalFrame

METRE_DIGITS, OTHER_DIGITS = 1, 3
UserRow = tuple[int, float | None, float | None, float, float, bool]
"""Place in ``user_ids``; east and north in m; age of information in slots; waiting data in MB; served in this slot."""


VEHICLE_COLUMNS: Mapping[str, int | None] = {
    "system_id": None,
    "autopilot": None,
    "mode": None,
    "mode_name": None,
    "armed": None,
    "landed": None,
    "position_ready": None,
    "lat_deg": 7,
    "lon_deg": 7,
    "east_m": 1,
    "north_m": 1,
    "alt_home_m": 1,
    "heading_deg": 1,
    "speed_mps": 2,
    "battery_fraction": 3,
    "return_fraction": 3,
    "battery_v": 2,
    "loss_ratio": 3,
    "heartbeat_age_s": 1,
    "position_age_s": 1,
}
"""Field of the stream's vehicles -> digits of its numbers (None: as it is)."""


class RecordedEvent(EventMessage):
    """A line of the campaign's log; ``sequence`` is its id there. ``at_slot``: where on the slot clock it fell."""

    at_slot: float
    at_s: float


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


class RecordedSample(View):
    """What was known of all vehicles at one moment, a row each."""

    at_s: float
    vehicles: list[list[Any]]


class TelemetryPage(View):
    """Some samples; ask again with ``first=next_first`` while that is not null. ``columns``: what the rows hold."""

    columns: list[str]
    samples: list[RecordedSample]
    next_first: int | None


class RecordingView(View):
    """Everything about a recorded campaign but its slots and telemetry."""

    campaign: CampaignStatic
    state: str
    reason: str
    begun_at: (
        datetime | None
    )  # of the first slot that was recorded; of the first record where none was; None without any
    ended_at: datetime | None  # likewise, the last one
    begun_at_s: float  # where these two are on the recording's axis
    ended_at_s: float
    first_slot: int | None  # None: no slot was recorded
    last_slot: int | None
    battery_j: float  # of a full battery, by the mission
    length_s: float  # from the first record to the last, launch and way home included
    slot_at_s: list[tuple[int, float]]  # the ends of the slots on that axis
    samples: int  # of telemetry; 0: none was kept
    events: list[RecordedEvent]


def without_files(document: Mapping[str, Any]) -> dict[str, Any]:
    """A mission's document with live users in place of its own, flown by chance: neither needs a file."""
    return {**document, "users": {"source": "live", "count": 1}, "policy": {"name": "random"}}


def recorded_events(
    events: Sequence[EventRecord], times: Sequence[SlotTime], clock: RecordedClock
) -> list[RecordedEvent]:
    """In the log's order, each with its place on the slot clock and on the recording's axis."""
    places = zip(events, slot_positions(events, times), clock.at_s(events), strict=True)
    return [_event(event, at_slot, at_s) for event, at_slot, at_s in places]


def telemetry_page(
    samples: Sequence[tuple[float, TelemetrySample]], frame: LocalFrame, battery_j: float, next_first: int | None
) -> TelemetryPage:
    """Of (at_s, sample): the vehicles in the stream's words, rounded to what a page can show."""
    told = [RecordedSample(at_s=at_s, vehicles=_vehicles(sample, frame, battery_j)) for at_s, sample in samples]
    return TelemetryPage(columns=list(VEHICLE_COLUMNS), samples=told, next_first=next_first)


def _vehicles(sample: TelemetrySample, frame: LocalFrame, battery_j: float) -> list[list[Any]]:
    views = [vehicle_view(one, sample.time_s, frame, None, battery_j) for one in sample.vehicles]
    return [[_short(getattr(view, name), digits) for name, digits in VEHICLE_COLUMNS.items()] for view in views]


def _short(value: Any, digits: int | None) -> Any:
    return value if digits is None or value is None else _rounded(value, digits)


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


def _event(event: EventRecord, at_slot: float, at_s: float) -> RecordedEvent:
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
        at_s=at_s,
    )


def _rounded(value: float, digits: int) -> float | None:
    return round(value, digits) if np.isfinite(value) else None
