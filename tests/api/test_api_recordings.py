"""Recorded campaigns over REST, and when events fell on the slot clock."""

import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import pytest
from api_server import Server
from hypothesis import given
from hypothesis import strategies as st

from gcs.api.recorded_clock import recorded_clock
from gcs.api.recordings import slot_positions
from gcs.ports import DecisionRecord, Event, TelemetrySample
from gcs.store.reading import SlotTime
from gcs.store.records import EventRecord
from gcs.store.telemetry import SampleTime

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


def samples(*rows: tuple[float, float]) -> list[SampleTime]:
    return [SampleTime(i, time_s, NOON + timedelta(seconds=wall_s)) for i, (time_s, wall_s) in enumerate(rows)]


def test_a_recording_goes_from_the_launch_to_the_landing_by_the_flight_clock():
    slots, told = times((30.0, 0), (45.0, 1)), samples((10.0, 0), (28.0, 0), (70.0, 2))
    clock = recorded_clock(slots, told)
    assert (clock.by_wall, clock.length_s) == (False, 60.0)
    assert clock.at_s(slots) == [20.0, 35.0]
    assert clock.at_s(told) == [0.0, 18.0, 60.0]
    assert clock.at_s([event(5.0, 0), event(31.5, 0), event(0.0, 0), event(99.0, 0)]) == [0.0, 21.5, 21.5, 60.0]


def test_after_a_restart_on_the_way_home_the_wall_clock_tells_where_everything_is():
    slots, told = times((30.0, 0), (45.0, 15.0)), samples((20.0, -10.0), (46.0, 16.0), (2.0, 30.0), (9.0, 37.0))
    clock = recorded_clock(slots, told)
    assert clock.by_wall
    assert clock.at_s(told) == [0.0, 26.0, 40.0, 47.0]
    assert clock.at_s(slots) == [10.0, 25.0]


def test_where_no_telemetry_was_kept_the_slots_are_all_there_is():
    clock = recorded_clock(times((30.0, 0), (45.0, 1)), [])
    assert (clock.at_s(times((30.0, 0), (45.0, 1))), clock.length_s) == ([0.0, 15.0], 15.0)


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


def test_telemetry_comes_in_parts_as_the_stream_would_have_told_it(flown: str, keyed: Server, operator: httpx.Client):
    fleet = keyed.control.snapshot().vehicles
    for time_s in (9.9, 10.0, 40.0):
        keyed.store.journal.record_telemetry(flown, TelemetrySample(time_s, fleet))
    assert keyed.store.journal.flush(WAIT_S)
    told = operator.get(f"/api/v1/campaigns/{flown}/recording").json()
    assert (told["samples"], told["length_s"]) == (3, 40.0)
    assert told["slot_at_s"] == [[0, 0.0], [1, 15.0], [2, 30.0]]
    url = f"/api/v1/campaigns/{flown}/recording/telemetry"
    part = operator.get(url, params={"limit": 2}).json()
    assert [one["at_s"] for one in part["samples"]] == [9.9, 10.0]
    first = dict(zip(part["columns"], part["samples"][1]["vehicles"][0], strict=True))
    live = operator.get("/api/v1/drones/1").json()
    exact = ("system_id", "mode", "mode_name", "armed", "landed", "position_ready", "battery_fraction", "alt_home_m")
    assert {name: first[name] for name in exact} == {name: live[name] for name in exact}
    assert first["heading_deg"] == pytest.approx(53.1, abs=0.05)
    assert (first["heartbeat_age_s"], first["speed_mps"]) == (0.2, 5.0)
    assert first["east_m"] == pytest.approx(847.0, abs=3.0)
    rest = operator.get(url, params={"first": part["next_first"]}).json()
    assert ([one["at_s"] for one in rest["samples"]], rest["next_first"]) == ([40.0], None)
    assert operator.get(url, params={"first": 2**31 - 1}).json()["samples"] == []
    assert operator.get("/api/v1/campaigns/none/recording/telemetry").status_code == 404


def decision(slot: int, **change: Any) -> DecisionRecord:
    still = ((1.0, 2.0),) * 2
    told = {"horizon_slots": 8, "relations": [[{"user": 1, "weight": 0.4}]], "predicted_user_enu_m": [[0, 0], [7, 8]]}
    record = DecisionRecord(
        slot, still, still, (9.0,) * 2, (True,) * 2, (math.pi / 2, -math.pi / 2), (7.0, 8.0), 2.5, explanation=told
    )
    return replace(record, time_s=0.2 + 15.0 * slot, **change)


def test_reasons_come_in_parts_each_with_the_decision_that_it_belongs_to(
    flown: str, keyed: Server, operator: httpx.Client
) -> None:
    late, unknown = decision(1, flown=False), decision(2, explanation=None)
    for record in (decision(0), late, decision(1, duration_ms=7.0), unknown):
        keyed.store.journal.record_decision(flown, record)
    assert keyed.store.journal.flush(WAIT_S)
    url = f"/api/v1/campaigns/{flown}/recording/explanations"
    part = operator.get(url, params={"limit": 2}).json()
    (first,) = part["decisions"]
    assert (first["at_s"], first["slot"], first["told"], first["horizon_slots"]) == (0.2, 0, "reasons", 8)
    assert first["moves"] == [[90.0, 7.0], [270.0, 8.0]]
    assert first["uavs"][0]["relations"] == [{"user": 1, "weight": 0.4, "expected_m": [7.0, 8.0]}]
    rest = operator.get(url, params={"first": part["next_first"]}).json()
    assert [(one["slot"], one["duration_ms"], one["told"]) for one in rest["decisions"]] == [
        (1, 7.0, "reasons"),
        (2, 2.5, "unknown"),
    ]
    assert rest["next_first"] is None
    assert operator.get(url, params={"first": 2**31 - 1}).json()["decisions"] == []
    assert operator.get("/api/v1/campaigns/none/recording/explanations").status_code == 404


def test_a_report_has_the_reasons_and_without_places_nobody_in_them(
    flown: str, keyed: Server, operator: httpx.Client
) -> None:
    keyed.store.journal.record_decision(flown, decision(0))
    assert keyed.store.journal.flush(WAIT_S)
    url = f"/api/v1/campaigns/{flown}/report"
    whole, bare = (operator.get(url, params={"places": places}).json()["decisions"] for places in (True, False))
    assert [uav["relations"] for uav in whole[0]["explanation"]["uavs"]] != [[]]
    assert [uav["relations"] for uav in bare[0]["explanation"]["uavs"]] == [[]]


def test_nothing_started_is_nothing_to_replay(campaign_id: str, operator: httpx.Client) -> None:
    answer = operator.get(f"/api/v1/campaigns/{campaign_id}/recording")
    assert (answer.status_code, "nothing to replay" in answer.json()["detail"]) == (409, True)
    assert operator.get("/api/v1/campaigns/none/recording/slots").status_code == 404


def test_a_campaign_that_failed_before_its_first_slot_shows_its_launch_and_why(
    keyed: Server, operator: httpx.Client, campaign_id: str
) -> None:
    journal, fleet = keyed.store.journal, keyed.control.snapshot().vehicles
    for time_s in (10.0, 11.0, 30.0):
        journal.record_telemetry(campaign_id, TelemetrySample(time_s, fleet))
    for time_s, state, reason in ((10.0, "launching", ""), (30.0, "failed", "UAV 1 did not climb")):
        data = {"state": state, "reason": reason}
        journal.record(Event(time_s, "campaign.state", state, campaign_id=campaign_id, data=data))
    assert journal.flush(WAIT_S)
    told = operator.get(f"/api/v1/campaigns/{campaign_id}/recording").json()
    assert (told["state"], told["reason"], told["length_s"]) == ("failed", "UAV 1 did not climb", 20.0)
    assert (told["first_slot"], told["last_slot"], told["slot_at_s"], told["samples"]) == (None, None, [], 3)
    assert [(one["message"], one["at_s"]) for one in told["events"]][-2:] == [("launching", 0.0), ("failed", 20.0)]
    telemetry = operator.get(f"/api/v1/campaigns/{campaign_id}/recording/telemetry").json()
    assert [one["at_s"] for one in telemetry["samples"]] == [0.0, 1.0, 20.0]
    assert operator.get(f"/api/v1/campaigns/{campaign_id}/recording/slots").json()["slots"] == []
    assert operator.get(f"/api/v1/campaigns/{campaign_id}/recording/explanations").json()["decisions"] == []


def test_a_campaign_that_was_struck_off_shows_its_log(operator: httpx.Client, campaign_id: str) -> None:
    assert operator.post(f"/api/v1/campaigns/{campaign_id}/abort").status_code == 202
    told = operator.get(f"/api/v1/campaigns/{campaign_id}/recording").json()
    assert (told["state"], told["samples"], told["first_slot"]) == ("aborted", 0, None)
    assert "struck off" in told["reason"]
    assert [one["kind"] for one in told["events"]] == ["campaign.created", "campaign.struck_off"]
