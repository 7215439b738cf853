"""Campaigns over REST."""

from pathlib import Path

import httpx
import pytest
from api_server import SMALL, Server, serving

from gcs.api.settings import ApiSettings
from gcs.ports import CampaignState, Event, RequestKind
from gcs.store.keys import Role
from gcs.store.store import Store

WAIT_S = 10.0


def post(client: httpx.Client, campaign_id: str, action: str) -> httpx.Response:
    return client.post(f"/api/v1/campaigns/{campaign_id}/{action}")


def test_a_campaign_is_created_from_a_document_and_from_a_mission_at_hand(operator: httpx.Client) -> None:
    by_document = operator.post("/api/v1/campaigns", json=SMALL)
    by_name = operator.post("/api/v1/campaigns", json={"mission": "demo", "policy": "random"})
    assert (by_document.status_code, by_name.status_code) == (201, 201)
    assert by_document.json()["static"]["serving_radius_m"] == pytest.approx(225.9, abs=0.1)
    assert (by_name.json()["name"], by_name.json()["policy"], by_name.json()["state"]) == ("demo", "random", "ready")
    listed = operator.get("/api/v1/campaigns").json()
    assert [c["id"] for c in listed] == [by_name.json()["id"], by_document.json()["id"]]


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"mission": "nowhere"}, "known:"),
        ({"mission": "../../etc/passwd"}, "known:"),
        ({"mission": "demo", "policy": "wise"}, "wise"),
        (SMALL | {"fleet": SMALL["fleet"] | {"launch_m": [9999.0, 0.0]}}, "launch_m"),
        (SMALL | {"campagne": {}}, "campagne"),
        (SMALL | {"users": {"source": "trace", "trace": "/etc/passwd"}}, "is a path"),
        (SMALL | {"users": {"source": "trace", "trace": "missing.csv"}}, "trace"),
        ({}, "campaign"),
        ([], "body"),
        ("text", "body"),
    ],
)
def test_a_document_that_cannot_be_flown_is_told_in_one_line(operator: httpx.Client, body: object, words: str) -> None:
    answer = operator.post("/api/v1/campaigns", json=body)
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert words in answer.json()["detail"]
    assert "\n" not in answer.json()["detail"]
    assert operator.get("/api/v1/campaigns").json() == []


def test_start_pause_resume_abort(keyed: Server, operator: httpx.Client, campaign_id: str) -> None:
    for action, state in (("start", "flying"), ("pause", "paused"), ("resume", "flying"), ("abort", "recovering")):
        answer = post(operator, campaign_id, action)
        assert (answer.status_code, answer.json()["state"]) == (202, state)
        assert operator.get(f"/api/v1/campaigns/{campaign_id}").json()["state"] == state
    kinds = [request.kind for request in keyed.control.requests]
    assert kinds == [RequestKind.START, RequestKind.PAUSE, RequestKind.RESUME, RequestKind.ABORT]
    assert keyed.control.requests[0].mission is not None
    assert {request.actor for request in keyed.control.requests} == {"operator"}


def test_what_the_state_forbids_is_a_conflict_with_the_reason(
    keyed: Server, operator: httpx.Client, campaign_id: str
) -> None:
    for action in ("pause", "resume"):
        answer = post(operator, campaign_id, action)
        assert (answer.status_code, answer.json()["state"]) == (409, "ready")
    assert keyed.control.requests == []
    post(operator, campaign_id, "start")
    again, resume = post(operator, campaign_id, "start"), post(operator, campaign_id, "resume")
    assert (again.status_code, "flying" in again.json()["detail"]) == (409, True)
    assert (resume.status_code, resume.json()["detail"]) == (409, "cannot resume while flying")
    other = operator.post("/api/v1/campaigns", json=SMALL).json()["id"]
    busy = post(operator, other, "start")
    assert (busy.status_code, busy.json()["detail"]) == (409, "another campaign is in the air")
    keyed.control.finish()
    assert post(operator, campaign_id, "abort").status_code == 409


def test_a_campaign_that_never_flew_is_struck_off(keyed: Server, operator: httpx.Client, campaign_id: str) -> None:
    assert post(operator, campaign_id, "abort").json()["state"] == "aborted"
    assert keyed.control.requests == []
    assert post(operator, campaign_id, "start").status_code == 409


def test_an_unknown_campaign_is_not_found(operator: httpx.Client) -> None:
    for method, path in (("GET", ""), ("POST", "/start"), ("POST", "/abort"), ("GET", "/report")):
        assert operator.request(method, f"/api/v1/campaigns/none{path}").status_code == 404


def test_slot_and_metrics_come_from_the_flight_and_afterwards_from_the_store(
    keyed: Server, operator: httpx.Client, campaign_id: str
) -> None:
    post(operator, campaign_id, "start")
    keyed.store.journal.record_slot(campaign_id, keyed.control.end_slot(2))
    data = {"state": CampaignState.DONE}
    keyed.store.journal.record(Event(30.0, "campaign.state", "flying -> done", campaign_id=campaign_id, data=data))
    assert keyed.store.journal.flush(WAIT_S)
    flown = operator.get(f"/api/v1/campaigns/{campaign_id}").json()
    assert (flown["slot"], flown["state"], flown["metrics"]["episodic_aoi"]) == (2, "flying", 5.5)
    other = operator.post("/api/v1/campaigns", json=SMALL).json()["id"]
    keyed.control.finish()
    post(operator, other, "start")
    stored = operator.get(f"/api/v1/campaigns/{campaign_id}").json()
    assert (stored["slot"], stored["state"], stored["metrics"]["episodic_aoi"]) == (2, "done", 5.5)


def test_a_flight_that_does_not_answer_is_told_and_may_answer_later(
    keyed: Server, operator: httpx.Client, campaign_id: str
) -> None:
    keyed.control.silent = True
    answer = post(operator, campaign_id, "start")
    assert answer.status_code == 503
    assert "did not answer" in answer.json()["detail"]
    assert keyed.control.unanswered[0].cancelled() is False


def test_every_change_is_in_the_audit_log_with_its_author(
    keyed: Server, operator: httpx.Client, campaign_id: str
) -> None:
    post(operator, campaign_id, "start")
    operator.post("/api/v1/emergency-stop")
    assert keyed.store.journal.flush(WAIT_S)
    events = operator.get("/api/v1/events").json()["events"]
    assert [(e["kind"], e["actor"]) for e in events] == [
        ("campaign.created", "operator"),
        ("api.start", "operator"),
        ("api.emergency_stop", "operator"),
    ]
    assert [e["campaign_id"] for e in events] == [campaign_id, campaign_id, None]
    with keyed.client(Role.VIEWER) as viewer:
        assert post(viewer, campaign_id, "abort").status_code == 403
    assert keyed.store.journal.flush(WAIT_S)
    refused = operator.get("/api/v1/events", params={"kind": "api.refused"}).json()["events"]
    assert [(e["actor"], e["severity"]) for e in refused] == [("viewer", "caution")]


def test_the_checklist_is_shown_and_only_an_admin_overrides_it(
    keyed: Server, operator: httpx.Client, campaign_id: str
) -> None:
    shown = operator.get(f"/api/v1/campaigns/{campaign_id}/preflight").json()
    assert not shown["ok"]
    red = {line["check"] for line in shown["lines"] if line["grade"] == "red"}
    assert {"ground", "position"} <= red, "the fake's drones fly already"
    assert operator.post(f"/api/v1/campaigns/{campaign_id}/start?override=true").status_code == 403
    with keyed.client(Role.ADMIN) as admin:
        assert admin.post(f"/api/v1/campaigns/{campaign_id}/start?override=true").status_code == 202
    assert [request.override for request in keyed.control.requests] == [True]
    assert keyed.store.journal.flush(WAIT_S)
    (told,) = operator.get("/api/v1/events", params={"kind": "api.start"}).json()["events"]
    assert (told["actor"], told["message"]) == ("admin", "start asked for in spite of red pre-flight lines")


def test_the_checklist_is_of_the_drones_that_a_start_takes(server_store: Store, tmp_path: Path) -> None:
    """They are taken as they were named (``--drone 2=... --drone 7=...``), not by their numbers; heard are 1, 2."""
    named = {}
    for seats in ((), (2, 7, 1)):
        settings = ApiSettings(one_time_key="k", dashboard=tmp_path / "none", seats=seats)
        with serving(server_store, settings) as server, httpx.Client(base_url=server.url, trust_env=False) as client:
            body, key = {"mission": "demo"}, {"authorization": "Bearer k"}
            made = client.post("/api/v1/campaigns", json=body, headers=key).json()["id"]
            lines = client.get(f"/api/v1/campaigns/{made}/preflight").json()["lines"]
            named[seats] = list(dict.fromkeys(line["system_id"] for line in lines))
    assert named == {(): [1, 2], (2, 7, 1): [2, 7]}
