"""Live users: over REST, and the rules of fixes by themselves."""

import json
from datetime import UTC, datetime, timedelta

import httpx
import numpy as np
import pytest
from api_server import LIVE, SMALL, Server
from hypothesis import given
from hypothesis import strategies as st
from websockets.sync.client import connect

from gcs.api.bodies import MAX_BATCH, MAX_MESSAGE
from gcs.api.live_users import Fix, LiveCampaigns, LiveUsers
from gcs.fleet.ledger import CampaignLedger, FleetState
from gcs.ports import OperatorRequest, RequestKind
from policy.mission_file import parse_mission
from policy.world.frames import LocalFrame

WAIT_S = 10.0
NOW = datetime(2026, 5, 1, tzinfo=UTC)
FRAME = LocalFrame(40.4203, -86.93)
INSIDE = {"lat_deg": 40.4253, "lon_deg": -86.92}


def fix(user: str, seconds: float, north_m: float = 100.0) -> Fix:
    lat_deg, lon_deg = FRAME.to_geodetic_deg(50.0, north_m)
    return Fix(user, float(lat_deg), float(lon_deg), NOW + timedelta(seconds=seconds))


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(-500, 50), st.integers(0, 999)), max_size=30))
def test_the_newest_fix_counts_whatever_the_order(reports: list[tuple[str, int, int]]) -> None:
    users = LiveUsers(FRAME, (1000.0, 1000.0), 3)
    for user, seconds, north_m in reports:
        tally = users.report([fix(user, seconds, north_m)], NOW)
        assert tally.accepted + tally.stale == 1
    newest = {user: max(s for u, s, _ in reports if u == user) for user, _, _ in reports}
    for row, user in enumerate(users.user_ids()):
        first = next(n for u, s, n in reports if u == user and s == newest[user])
        assert users.places()[row] == pytest.approx([50.0, first], abs=1e-6)
    assert set(users.user_ids()) == set(newest)


def test_what_does_not_count_is_counted() -> None:
    users = LiveUsers(FRAME, (1000.0, 1000.0), 1)
    batch = [fix("a", 0), fix("a", 0), fix("a", -5), fix("a", 61), fix("a", 5, 2000.0), fix("b", 0)]
    tally = users.report(batch, NOW)
    assert (tally.accepted, tally.stale, tally.early, tally.outside, tally.full) == (1, 2, 1, 1, 1)


def test_users_join_before_the_start_and_after_it() -> None:
    mission, live = parse_mission(LIVE), LiveCampaigns(wall=lambda: NOW)
    request = OperatorRequest(RequestKind.START, "ann", "c1", mission)
    with pytest.raises(ValueError, match="no user"):
        live.enrol(request, mission.scenario)
    users = live.users("c1", mission)
    users.report([fix("a", 0), fix("b", 0)], NOW)
    scenario, ids, places = live.enrol(request, mission.scenario)
    users.report([fix("c", 0), fix("a", 1, 300.0)], NOW)
    assert (scenario.num_users, ids, places.num_users) == (3, ("a", "b", ""), 3)
    assert np.allclose(places.positions(5), [[50.0, 300.0], [50.0, 100.0], [50.0, 100.0]], atol=1e-6)


def test_receipts_count_once_and_only_when_they_are_of_now() -> None:
    users = LiveUsers(FRAME, (1000.0, 1000.0), 3)
    users.report([fix("a", 0), fix("b", 0)], NOW)
    told = [("a", 0), ("a", 0), ("a", -5), ("b", -61), ("b", 61), ("c", 0)]
    assert [users.receive(user, NOW + timedelta(seconds=s), NOW) for user, s in told] == [True] + 5 * [False]
    assert [list(column) for column in users.take_receipts()] == [[True, False, False]] * 2
    assert [list(column) for column in users.take_receipts()] == [[False] * 3, [True, False, False]]


def test_the_books_follow_who_joins_and_what_receipts_say() -> None:
    """Row 0 is in reach and tells nothing, row 1 is in reach but says that nothing arrived, row 2 joins later."""
    mission, live = parse_mission(LIVE), LiveCampaigns(wall=lambda: NOW)
    users = live.users("c1", mission)
    users.report([fix("a", 0), fix("b", 0)], NOW)
    scenario, ids, places = live.enrol(OperatorRequest(RequestKind.START, "ann", "c1", mission), mission.scenario)
    here = FleetState(np.full((2, 2), (50.0, 100.0)), np.zeros((2, 2)), np.zeros(2), np.ones(2, dtype=np.bool_))
    ledger = CampaignLedger(scenario, places, ids, (1, 2), here)
    users.receive("b", NOW, NOW)
    records = [ledger.record(0.0, here, None)]
    for slot in range(1, 4):
        if slot == 2:
            users.report([fix("c", 5, 900.0)], NOW)
        state = ledger.state(here)
        assert list(state.user_active) == [True, True, slot >= 2]
        ledger.close_slot(here)
        records.append(ledger.record(15.0 * slot, here, None))
    assert [[user.user_id for user in record.users] for record in records] == [["a", "b"]] * 2 + [["a", "b", "c"]] * 2
    assert [[user.served for user in record.users] for record in records[1:]] == [
        [True, True],
        [True, False, False],
        [True, False, False],
    ]
    assert [user.aoi_slots for user in records[-1].users] == [1.0, 3.0, 3.0]
    again = CampaignLedger(scenario, places, ids, (1, 2), here)
    again.reopen(records)
    assert again.metrics(np.zeros(2)) == ledger.metrics(np.zeros(2))


def test_the_books_let_users_go_and_take_them_back() -> None:
    """User b leaves in slot 1 and comes back in slot 3; c falls silent; a stays. Nobody is in reach but b."""
    now = [NOW]
    mission, live = parse_mission(LIVE), LiveCampaigns(timedelta(minutes=1), wall=lambda: now[0])
    users = live.users("c1", mission)
    users.report([fix("a", 0, 900.0), fix("b", 0), fix("c", 0, 900.0)], NOW)
    scenario, ids, places = live.enrol(OperatorRequest(RequestKind.START, "ann", "c1", mission), mission.scenario)
    here = FleetState(np.full((2, 2), (50.0, 100.0)), np.zeros((2, 2)), np.zeros(2), np.ones(2, dtype=np.bool_))
    ledger = CampaignLedger(scenario, places, ids, (1, 2), here)
    records = [ledger.record(0.0, here, None)]
    for slot, active in enumerate([[True, True, True], [True, False, False], [True, True, False]], start=1):
        assert list(ledger.state(here).user_active) == active
        if slot == 1:
            assert users.depart("b", NOW + timedelta(seconds=10))
            assert not users.depart("b", NOW), "an older word"
            assert not users.depart("nobody", NOW)
            assert users.report([fix("b", 5)], NOW).stale == 1, "a fix from before he left does not bring him back"
            now[0] += timedelta(minutes=2)
            users.report([fix("a", 20, 900.0)], now[0])
        if slot == 2:
            users.report([fix("b", 30, 900.0)], now[0])
        ledger.close_slot(here)
        records.append(ledger.record(15.0 * slot, here, None))
    users_of = [[(u.user_id, u.active, u.aoi_slots, u.served) for u in record.users] for record in records[1:]]
    assert users_of[0] == [("a", True, 2.0, False), ("b", True, 1.0, True), ("c", True, 2.0, False)]
    assert users_of[1] == [("a", True, 3.0, False), ("b", False, 1.0, False), ("c", False, 2.0, False)]
    assert users_of[2] == [("a", True, 4.0, False), ("b", True, 2.0, False), ("c", False, 2.0, False)]
    assert np.isnan(records[2].users[1].east_m), "the place of who left is not kept"
    metrics = ledger.metrics(np.zeros(2))
    assert metrics is not None
    assert metrics.episodic_aoi == pytest.approx((2 + 3 + 4 + 1 + 2 + 2) / 6)
    rate_mb = 15.0 * float(scenario.collect_mbps[0])
    assert metrics.data_collection_ratio == pytest.approx(1.0 - (3 + 1 + 1) * rate_mb / (6 * rate_mb))
    again = CampaignLedger(scenario, places, ids, (1, 2), here)
    again.reopen(records)
    assert again.metrics(np.zeros(2)) == metrics


def test_fixes_and_receipts_over_rest(keyed: Server, operator: httpx.Client) -> None:
    campaign_id = operator.post("/api/v1/campaigns", json=LIVE).json()["id"]
    url = f"/api/v1/campaigns/{campaign_id}"
    batch = [INSIDE | {"user": "u17", "time": "2026-05-01T10:00:00Z"}, INSIDE | {"user": "u18", "time": 1_700_000_000}]
    taken = operator.post(f"{url}/fixes", json=batch)
    assert (taken.status_code, taken.json()["accepted"]) == (202, 2)
    assert operator.post(f"{url}/fixes", json=batch).json()["stale"] == 2
    receipt = [{"user": "u17", "time": "2026-05-01T12:00:00+02:00", "uploaded_mb": 0.3}]
    assert operator.post(f"{url}/uploads", json=receipt).status_code == 202
    assert keyed.store.journal.flush(WAIT_S)
    (row,) = keyed.store.uploads.of(campaign_id)
    assert (row.user_id, row.uploaded_mb, row.uploaded_at) == ("u17", 0.3, datetime(2026, 5, 1, 10, tzinfo=UTC))


@pytest.mark.parametrize(
    "change",
    [
        {"lat_deg": 91}, {"lon_deg": "east"}, {"time": "noon"}, {"time": "2026-05-01T10:00:00"}, {"time": -1},
        {"time": 1e300}, {"user": ""}, {"user": "a\x00b"}, {"pending_mb": -1}, {"extra": 1}, {"time": True},
    ],
)  # fmt: skip
def test_a_fix_that_is_none_is_refused_with_the_whole_batch(operator: httpx.Client, change: dict[str, object]) -> None:
    campaign_id = operator.post("/api/v1/campaigns", json=LIVE).json()["id"]
    good = INSIDE | {"user": "u17", "time": "2026-05-01T10:00:00Z"}
    answer = operator.post(f"/api/v1/campaigns/{campaign_id}/fixes", json=[good, good | change])
    assert answer.status_code == 422
    assert answer.json()["detail"].startswith("/1/")
    assert operator.post(f"/api/v1/campaigns/{campaign_id}/fixes", json=[good]).json()["accepted"] == 1


def test_a_campaign_that_takes_no_live_users(operator: httpx.Client) -> None:
    campaign_id = operator.post("/api/v1/campaigns", json=SMALL).json()["id"]
    good = INSIDE | {"user": "u17", "time": "2026-05-01T10:00:00Z"}
    assert operator.post(f"/api/v1/campaigns/{campaign_id}/fixes", json=[good]).status_code == 409
    live_id = operator.post("/api/v1/campaigns", json=LIVE).json()["id"]
    operator.post(f"/api/v1/campaigns/{live_id}/abort")
    assert operator.post(f"/api/v1/campaigns/{live_id}/fixes", json=[good]).status_code == 409


def test_a_batch_has_a_largest_size(local: Server) -> None:
    """Over REST and over the WebSocket; what is above is refused whole."""
    with local.client() as client:
        client.headers["authorization"] = "Bearer only-once"
        path = f"/api/v1/campaigns/{client.post('/api/v1/campaigns', json=LIVE).json()['id']}"
        one = INSIDE | {"user": "u1", "time": 1_700_000_000}
        assert client.post(f"{path}/fixes", json=[one] * (MAX_BATCH + 1)).status_code == 422
        assert client.post(f"{path}/fixes", json=[one] * 10).json()["accepted"] == 1, "nothing of it was taken"
    url, key = local.url.replace("http", "ws") + f"{path}/reports", {"authorization": "Bearer only-once"}
    with connect(url, additional_headers=key, proxy=None) as phone:
        phone.send(json.dumps({"type": "fixes", "number": 1, "fixes": [one] * (MAX_MESSAGE + 1)}))
        assert json.loads(phone.recv(WAIT_S))["status"] == 422
