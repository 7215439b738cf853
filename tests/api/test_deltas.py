"""A client of deltas knows what a client of snapshots knows, for less."""

import copy
import json
from typing import Any

import pytest
from fleet_at_work import RATE_HZ, fleet_snapshot
from hypothesis import given, settings
from hypothesis import strategies as st
from test_stream_session import Client

from gcs.api.deltas import _rounded, delta, plans_told, told
from gcs.api.schemas import SnapshotMessage
from gcs.api.views import snapshot_message
from policy.world.frames import LocalFrame

FRAME = LocalFrame(47.396, 8.54)
LIMIT_BYTES_A_S = 200_000


def message(tick: int, **size: int) -> SnapshotMessage:
    return snapshot_message(fleet_snapshot(tick, **size), healthy=True, frame=FRAME, verdicts={})


def applied(before: dict[str, Any], change: dict[str, Any]) -> dict[str, Any]:
    """As the page does it."""
    now = copy.deepcopy(before) | change["changed"]
    by_id = {one["system_id"]: one for one in change["vehicles"]}
    now["vehicles"] = [one | by_id.get(one["system_id"], {}) for one in now["vehicles"]]
    now["campaign"] = now["campaign"] and now["campaign"] | {"users": None} | change["campaign"]
    return now


def test_deltas_add_up_to_the_snapshot() -> None:
    known = told(message(0, vehicles=5, users=3))
    for tick in (1, 2, 74, 75, 76):
        now = told(message(tick, vehicles=5, users=3))
        change = delta(known, now)
        assert change is not None
        known = applied(known, json.loads(change.model_dump_json()))
        assert known == now


def test_nothing_new_says_nothing() -> None:
    same = told(message(3, vehicles=4, users=2))
    change = delta(same, same)
    assert change is not None
    assert (change.changed, change.vehicles, change.campaign) == ({}, [], {})


def test_another_fleet_or_campaign_takes_a_whole_snapshot() -> None:
    now = told(message(1, vehicles=4, users=2))
    assert delta(None, now) is None
    assert delta(told(message(0, vehicles=3, users=2)), now) is None
    assert delta(now | {"campaign": None}, now) is None


def test_places_are_told_to_a_centimetre_and_reasons_are_left_to_their_route() -> None:
    whole = told(message(1, vehicles=1, users=1))
    (vehicle,) = whole["vehicles"]
    exact = message(1, vehicles=1, users=1).vehicles[0]
    assert exact.lat_deg is not None
    assert vehicle["lat_deg"] == pytest.approx(exact.lat_deg, abs=6e-8)
    assert vehicle["east_m"] == pytest.approx(exact.east_m, abs=0.006)
    assert whole["campaign"]["explanation"] == {}


def test_a_session_tells_whole_snapshots_unless_asked_for_deltas() -> None:
    client = Client(deltas=True)
    client.start("c1")
    kinds = []
    for _ in range(3):
        kinds.append([one["type"] for one in client.step()])
        client.control.tick()
    assert kinds == [["campaign", "snapshot"], ["delta"], ["delta"]]
    assert client.session.hear('{"type": "subscribe"}') is None
    assert [one["type"] for one in client.step()] == ["snapshot"]
    assert client.session.hear('{"type": "subscribe", "deltas": true}') is None
    assert [one["type"] for one in client.step()] == ["snapshot"]


def test_a_hundred_vehicles_and_two_thousand_users_stay_below_200_kb_a_second() -> None:
    ticks = int(15 * RATE_HZ)  # a slot, in which users are told once
    client = Client(deltas=True)
    client.control.publish(fleet_snapshot(0))
    list(client.session.step())
    sent = 0
    for tick in range(1, ticks + 1):
        client.control.publish(fleet_snapshot(tick))
        sent += sum(len(text.encode()) for text in client.session.step())
    rate = sent / ticks * RATE_HZ
    print(f"{rate / 1000:.0f} kB/s")
    assert rate < LIMIT_BYTES_A_S


@settings(max_examples=200, deadline=None)
@given(st.floats(-1e7, 1e7), st.sampled_from((2, 4, 7)))
def test_rounding_is_to_the_nearest_decimal(value: float, digits: int) -> None:
    rounded = _rounded(value, digits)
    assert abs(rounded - value) <= 0.5 * 10.0**-digits * 1.001 + 1e-9
    assert float(f"{rounded:.{digits}f}") == rounded


@pytest.mark.parametrize("value", [float("inf"), float("-inf"), 1e300, 1e18])
def test_what_has_no_decimals_stays_as_it_is(value: float) -> None:
    assert _rounded(value, 7) == value


def test_a_number_that_is_none_stays_one() -> None:
    assert _rounded(float("nan"), 2) != _rounded(float("nan"), 2)


def test_plans_made_once_are_told_as_if_made_at_each_tick() -> None:
    now = message(3, vehicles=4, users=2)
    assert now.campaign is not None
    assert now.campaign.plans
    plans = plans_told(now.campaign.plans)
    assert told(now, plans) == told(now)
    assert all(len(str(number)) < 12 for plan in plans for point in plan["path_m"] for number in point)
