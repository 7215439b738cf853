"""Dry runs, forecasts, series and mission documents over REST."""

import time
from typing import Any

import httpx
import pytest
from api_server import LIVE, SMALL, Server

from gcs.store.keys import Role

WAIT_S = 30.0


def finished(client: httpx.Client, run: dict[str, Any]) -> dict[str, Any]:
    deadline_s = time.monotonic() + WAIT_S
    while run["state"] == "running":
        assert time.monotonic() < deadline_s, run
        time.sleep(0.05)
        run = client.get(f"/api/v1/dry-runs/{run['id']}").json()
    return run


def test_a_dry_run_foretells_the_campaign_of_the_same_mission(operator: httpx.Client, campaign_id: str) -> None:
    assert operator.get(f"/api/v1/campaigns/{campaign_id}/forecast").status_code == 404
    begun = operator.post("/api/v1/dry-runs", json=SMALL)
    assert begun.status_code == 202, begun.text
    run = finished(operator, begun.json())
    assert (run["state"], run["reason"], run["slot"]) == ("done", "", 4)
    forecast = operator.get(f"/api/v1/campaigns/{campaign_id}/forecast").json()["forecast"]
    assert forecast == run["forecast"]
    assert [point["slot"] for point in forecast["series"]] == [1, 2, 3, 4]
    assert forecast["max_accel_mps2"] == pytest.approx(0.92 * 4.5)  # the vehicles did not say theirs
    assert [one["id"] for one in operator.get("/api/v1/dry-runs").json()] == [run["id"]]


def test_a_campaign_can_be_flown_dry_by_its_id_one_at_a_time(operator: httpx.Client, campaign_id: str) -> None:
    begun = operator.post("/api/v1/dry-runs", json={"campaign": campaign_id}).json()
    busy = operator.post("/api/v1/dry-runs", json=SMALL)
    assert (busy.status_code, busy.json()["dry_run"]) == (409, begun["id"])
    cancelled = operator.delete(f"/api/v1/dry-runs/{begun['id']}").json()
    assert (cancelled["state"], cancelled["reason"]) == ("cancelled", "cancelled by operator")


def test_what_cannot_be_foretold_is_told_at_once(keyed: Server, operator: httpx.Client, campaign_id: str) -> None:
    assert "live users" in operator.post("/api/v1/dry-runs", json=LIVE).json()["detail"]
    assert operator.post("/api/v1/dry-runs", json={"mission": "nowhere"}).status_code == 422
    assert operator.post("/api/v1/dry-runs", json={"campaign": "nowhere"}).status_code == 404
    assert operator.post("/api/v1/dry-runs", json={"campaign": campaign_id, "policy": "gcrl"}).status_code == 422
    assert operator.get("/api/v1/dry-runs/abc").status_code == 404
    with keyed.client(Role.VIEWER) as viewer:
        assert viewer.post("/api/v1/dry-runs", json=SMALL).status_code == 403


def test_the_series_has_a_point_a_slot_and_no_users(keyed: Server, operator: httpx.Client, campaign_id: str) -> None:
    operator.post(f"/api/v1/campaigns/{campaign_id}/start")
    for slot in range(3):
        keyed.store.journal.record_slot(campaign_id, keyed.control.end_slot(slot))
    assert keyed.store.journal.flush(10.0)
    points = operator.get(f"/api/v1/campaigns/{campaign_id}/series").json()
    assert [(point["slot"], point["mean_aoi_slots"]) for point in points] == [(1, 2.0), (2, 2.0)]
    assert points[0]["metrics"]["episodic_aoi"] == 5.5
    assert operator.get("/api/v1/campaigns/none/series").status_code == 404


def test_a_mission_at_hand_can_be_taken_changed_and_created(operator: httpx.Client) -> None:
    document = operator.get("/api/v1/missions/demo").json()
    document["campaign"]["name"] = "mine"
    document["area"]["obstacles"] = []
    created = operator.post("/api/v1/campaigns", json=document)
    assert created.status_code == 201, created.text
    assert (created.json()["name"], created.json()["static"]["obstacles"]) == ("mine", [])
    assert operator.get("/api/v1/missions/nowhere").status_code == 404
