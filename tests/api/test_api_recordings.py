"""Recorded campaigns over REST, and when events fell on the slot clock."""

from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import pytest
from api_server import Server
from hypothesis import given
from hypothesis import strategies as st

from gcs.api.recordings import slot_positions
from gcs.store.reading import SlotTime
from gcs.store.records import EventRecord

NOON = datetime(2026, 11, 1, 12, tzinfo=UTC)
WAIT_S = 10.0


def event(time_s: float, wall_s: float, **change: Any) -> EventRecord:
    values = {"severity": "info", "message": "x", "campaign_id": "c", "system_id": None, "actor": "ann", "data": {}}
    return EventRecord(1, NOON + timedelta(seconds=wall_s), time_s, "kind", **values | change)


def times(*rows: tuple[float, float]) -> list[SlotTime]:
    return [SlotTime(slot, time_s, NOON + timedelta(seconds=wall_s)) for slot, (time_s, wall_s) in enumerate(rows)]


def test_events_lie_between_the_ends_of_slots_by_the_flight_clock():
    events = [event(10.0, 0), event(37.5, 0), event(45.0, 0), event(900.0, 0)]
    assert slot_positions(events, times((30.0, 0), (45.0, 1), (60.0, 2))) == [0.0, 0.5, 1.0, 2.0]


def test_after_a_restart_in_flight_the_wall_clock_tells():
    events = [event(37.5, 8.0), event(3.0, 22.0), event(20.0, 45.0)]
    assert slot_positions(events, times((30.0, 0), (45.0, 15.0), (9.0, 30.0), (24.0, 45.0))) == [0.533, 1.467, 3.0]


def test_without_slots_everything_is_at_the_start():
    assert slot_positions([event(5.0, 5.0)], []) == [0.0]


@given(st.lists(st.floats(-1e6, 1e6), max_size=20), st.lists(st.floats(0, 1e6), min_size=1, max_size=20))
def test_places_never_go_back_and_stay_within_the_slots(when: list[float], clock: list[float]):
    places = slot_positions([event(t, t) for t in sorted(when)], times(*((t, t) for t in clock)))
    assert places == sorted(places)
    assert all(0.0 <= place <= len(clock) - 1 for place in places)


@pytest.fixture
def flown(keyed: Server, operator: httpx.Client, campaign_id: str) -> str:
    operator.post(f"/api/v1/campaigns/{campaign_id}/start")
    for slot in range(3):
        keyed.store.journal.record_slot(campaign_id, keyed.control.end_slot(slot))
    assert keyed.store.journal.flush(WAIT_S)
    return campaign_id


def test_the_recording_has_area_range_and_log(flown: str, operator: httpx.Client) -> None:
    told = operator.get(f"/api/v1/campaigns/{flown}/recording").json()
    assert (told["first_slot"], told["last_slot"], told["campaign"]["campaign_id"]) == (0, 2, flown)
    assert [one["kind"] for one in told["events"]] == ["campaign.created", "api.start"]
    assert all(0.0 <= one["at_slot"] <= 2.0 for one in told["events"])


def test_slots_come_in_parts_with_users_as_rows(flown: str, operator: httpx.Client) -> None:
    url = f"/api/v1/campaigns/{flown}/recording/slots"
    part = operator.get(url, params={"limit": 2}).json()
    assert ([one["slot"] for one in part["slots"]], part["next_first"]) == ([0, 1], 2)
    assert part["user_ids"] == ["u1", "u2"]
    assert part["slots"][1]["users"] == [[0, 10.0, 20.0, 3.0, 0.5, False], [1, None, None, 1.0, 0.0, True]]
    rest = operator.get(url, params={"first": part["next_first"]}).json()
    assert ([one["slot"] for one in rest["slots"]], rest["next_first"]) == ([2], None)
    assert operator.get(url, params={"first": 99}).json()["slots"] == []


def test_nothing_flown_is_nothing_to_replay(campaign_id: str, operator: httpx.Client) -> None:
    answer = operator.get(f"/api/v1/campaigns/{campaign_id}/recording")
    assert (answer.status_code, "nothing to replay" in answer.json()["detail"]) == (409, True)
    assert operator.get("/api/v1/campaigns/none/recording/slots").status_code == 404
