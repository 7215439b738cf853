"""Reports, events, missions, policies, health and metrics over REST."""

import csv
import io
import json
from pathlib import Path

import httpx
import pytest
from api_server import Server

from gcs.api.routes.shelf import checkpoints
from gcs.ports import Event, Severity
from gcs.store.keys import Role

WAIT_S = 10.0


def fly(server: Server, operator: httpx.Client, campaign_id: str) -> None:
    """Three records of a flown campaign."""
    operator.post(f"/api/v1/campaigns/{campaign_id}/start")
    for slot in range(3):
        server.store.journal.record_slot(campaign_id, server.control.end_slot(slot))
    assert server.store.journal.flush(WAIT_S)


def test_the_report_as_json_and_as_csv(keyed: Server, operator: httpx.Client, campaign_id: str) -> None:
    fly(keyed, operator, campaign_id)
    url = f"/api/v1/campaigns/{campaign_id}/report"
    report = operator.get(url).json()
    assert report["metrics"]["episodic_aoi"] == 5.5
    assert [slot["slot"] for slot in report["slots"]] == [0, 1, 2]
    assert [event["kind"] for event in report["events"]] == ["campaign.created", "api.start"]
    answer = operator.get(url, params={"format": "csv"})
    assert answer.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    assert [(row["slot"], row["kind"], row["id"], row["aoi"]) for row in rows[:2]] == [
        ("0", "user", "u1", "3.0"),
        ("0", "user", "u2", "1.0"),
    ]


def test_a_report_without_places_keeps_everything_else(keyed: Server, operator: httpx.Client, campaign_id: str) -> None:
    fly(keyed, operator, campaign_id)
    url = f"/api/v1/campaigns/{campaign_id}/report"
    full = operator.get(url).json()["slots"][-1]["users"][0]
    bare = operator.get(f"{url}?places=false").json()["slots"][-1]["users"][0]
    assert full["east_m"] == 10.0
    assert bare == full | {"east_m": None, "north_m": None}
    row = next(r for r in operator.get(f"{url}?places=false&format=csv").text.splitlines() if ",user,u1," in r)
    assert "10.0" not in row
    assert operator.get(f"{url}?places=false&format=html").status_code == 422


def test_the_report_as_tracks_for_map_programs(keyed: Server, operator: httpx.Client, campaign_id: str) -> None:
    fly(keyed, operator, campaign_id)
    url = f"/api/v1/campaigns/{campaign_id}/report"
    answer = operator.get(url, params={"format": "geojson"})
    assert answer.headers["content-type"] == "application/geo+json"
    kinds = [feature["properties"]["kind"] for feature in answer.json()["features"]]
    assert (kinds[0], kinds.count("user")) == ("area", 2)
    bare = operator.get(url, params={"format": "geojson", "places": False}).json()["features"]
    assert "user" not in {feature["properties"]["kind"] for feature in bare}
    answer = operator.get(url, params={"format": "kml", "places": False})
    assert answer.headers["content-disposition"].endswith(f'"campaign-{campaign_id}.kml"')
    assert "<name>u1</name>" in operator.get(url, params={"format": "kml"}).text
    assert "<name>u1</name>" not in answer.text


def test_the_report_says_how_to_fly_it_again(keyed: Server, operator: httpx.Client, campaign_id: str) -> None:
    fly(keyed, operator, campaign_id)
    report = operator.get(f"/api/v1/campaigns/{campaign_id}/report").json()
    again = report["provenance"]
    assert again["mission"]["campaign"]["name"] == "small"
    assert again["repeat"].startswith("python -m gcs fly mission.toml")
    assert again["versions"]["python"]
    assert [row["user_id"] for row in report["user_totals"]] == ["u1", "u2"]
    page = operator.get(f"/api/v1/campaigns/{campaign_id}/report", params={"format": "html"}).text
    assert again["machine"] in page
    assert "geojson" in page


def test_the_report_as_a_page_runs_no_script(keyed: Server, operator: httpx.Client, campaign_id: str) -> None:
    fly(keyed, operator, campaign_id)
    answer = operator.get(f"/api/v1/campaigns/{campaign_id}/report", params={"format": "html"})
    assert (answer.status_code, answer.headers["content-type"]) == (200, "text/html; charset=utf-8")
    assert "<svg" in answer.text
    assert "default-src 'none'" in answer.headers["content-security-policy"]


def test_a_report_before_the_first_slot(operator: httpx.Client, campaign_id: str) -> None:
    url = f"/api/v1/campaigns/{campaign_id}/report"
    assert operator.get(url).json()["slots"] == []
    assert operator.get(url, params={"format": "html"}).status_code == 409
    assert operator.get(url, params={"format": "pdf"}).status_code == 422


def test_events_are_filtered_and_paged(keyed: Server, operator: httpx.Client) -> None:
    for index in range(5):
        severity = Severity.WARNING if index % 2 else Severity.INFO
        keyed.store.journal.record(Event(float(index), "plan.late", str(index), severity, "c1"))
    keyed.store.journal.record(Event(9.0, "other", "other", Severity.CAUTION))
    assert keyed.store.journal.flush(WAIT_S)

    def messages(**params: object) -> list[str]:
        page = operator.get("/api/v1/events", params=params).json()  # type: ignore[arg-type]
        return [event["message"] for event in page["events"]]

    assert messages(campaign_id="c1") == ["0", "1", "2", "3", "4"]
    assert messages(severity="caution") == ["1", "3", "other"]
    assert messages(severity="warning", campaign_id="c1") == ["1", "3"]
    assert messages(newest=True, limit=2) == ["4", "other"]
    assert messages(since="2999-01-01T00:00:00Z") == []
    first = operator.get("/api/v1/events", params={"limit": 4}).json()
    rest = operator.get("/api/v1/events", params={"after_id": first["next_after_id"]}).json()
    assert [event["message"] for event in rest["events"]] == ["4", "other"]
    assert rest["next_after_id"] is None


@pytest.mark.parametrize(
    "params",
    [{"since": "yesterday"}, {"since": "2026-01-01T00:00:00"}, {"limit": 0}, {"severity": "loud"}, {"after_id": 2**40}],
)
def test_a_filter_that_is_none(operator: httpx.Client, params: dict[str, str | int]) -> None:
    assert operator.get("/api/v1/events", params=params).status_code == 422


@pytest.mark.parametrize("since", ["0001-01-01T00:00:00+14:00", "9999-12-31T23:59:59-14:00"])
def test_times_at_the_edge_of_the_calendar(operator: httpx.Client, since: str) -> None:
    assert operator.get("/api/v1/events", params={"since": since}).status_code == 200


def test_missions_and_policies_at_hand(operator: httpx.Client) -> None:
    missions = {mission["name"]: mission for mission in operator.get("/api/v1/missions").json()}
    assert {"demo", "purdue", "ncsu", "kaist"} <= set(missions)
    assert (missions["demo"]["uavs"], missions["demo"]["error"]) == (2, None)
    names = [policy["name"] for policy in operator.get("/api/v1/policies").json()]
    assert {"gcrl", "receding-horizon", "random"} <= set(names)


def test_checkpoints_come_with_their_provenance_cards(tmp_path: Path) -> None:
    for name in ("gcrl-default", "gcrl-odd", "other"):
        (tmp_path / f"{name}.safetensors").write_bytes(b"")
    (tmp_path / "gcrl-default.json").write_text(json.dumps({"seed": 3, "loss": float("nan")}))
    (tmp_path / "gcrl-odd.json").write_text("{")
    found = checkpoints(tmp_path, "gcrl")
    assert [(c.file, c.provenance) for c in found] == [
        ("gcrl-default.safetensors", {"seed": 3, "loss": None}),
        ("gcrl-odd.safetensors", None),
    ]


def test_readiness_tells_what_is_wrong(keyed: Server) -> None:
    with keyed.client() as anyone:
        assert anyone.get("/readyz").json()["ready"] is True
        keyed.control.late = True
        answer = anyone.get("/readyz")
        assert (answer.status_code, answer.json()["problems"]) == (503, ["the flight loop is late"])
        assert anyone.get("/healthz").json() == {"alive": True}


def test_metrics_tell_the_flight_the_store_and_http(keyed: Server, campaign_id: str) -> None:
    assert keyed.store.journal.flush(WAIT_S)
    with keyed.client(Role.VIEWER) as viewer:
        viewer.get("/api/v1/drones/77")
        text = viewer.get("/metrics").text
    assert "gcs_flight_ticks_total 100.0" in text
    assert 'gcs_link_loss_ratio{system_id="2"} 0.0' in text
    assert 'gcs_events_total{kind="campaign.created",severity="info"} 1.0' in text
    assert "gcs_store_written_records_total 1.0" in text
    assert 'status="404"' in text
    assert "drones/77" not in text


def test_a_page_that_is_not_built_says_how(keyed: Server) -> None:
    with keyed.client() as anyone:
        assert "gcs/dashboard/build.py" in anyone.get("/").text
