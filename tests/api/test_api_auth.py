"""Who may do what: over real HTTP, and the table of roles by itself."""

import math
import time

import httpx
import pytest
from api_server import LIVE, SMALL, Server

from gcs.api.app import REFUSALS_A_SECOND, create_app
from gcs.api.auth import needed_role
from gcs.store.keys import Role
from gcs.store.reading import EventFilter

OPEN = ("/", "/healthz", "/readyz", "/openapi.json", "/docs")
READING = ("/api/v1/campaigns", "/api/v1/drones", "/api/v1/events", "/api/v1/missions", "/api/v1/me", "/metrics")


def test_without_a_key_only_what_holds_no_data_is_open(keyed: Server) -> None:
    with keyed.client() as stranger:
        assert [stranger.get(path).status_code for path in OPEN] == [200] * len(OPEN)
        answers = [stranger.get(path) for path in READING]
    assert [answer.status_code for answer in answers] == [401] * len(READING)
    assert {answer.headers["www-authenticate"] for answer in answers} == {'Bearer realm="gcs"'}


@pytest.mark.parametrize("header", ["Bearer", "Bearer wrong", "Basic dXNlcjpwYXNz", "Bearer ucs_00000000_x"])
def test_a_wrong_key_is_refused(keyed: Server, header: str) -> None:
    with keyed.client() as stranger:
        answer = stranger.get("/api/v1/drones", headers={"authorization": header})
    assert answer.status_code == 401
    assert answer.json()["status"] == 401


def test_each_role_may_do_what_it_may(keyed: Server) -> None:
    expected = {Role.VIEWER: (200, 403, 403), Role.OPERATOR: (200, 201, 403), Role.ADMIN: (200, 201, 201)}
    for role, statuses in expected.items():
        with keyed.client(role) as client:
            reading = client.get("/api/v1/drones").status_code
            flying = client.post("/api/v1/campaigns", json=SMALL).status_code
            managing = client.post("/api/v1/keys", json={"name": "new", "role": "viewer"}).status_code
        assert (reading, flying, managing) == statuses


def test_every_route_that_changes_anything_needs_at_least_an_operator(keyed: Server) -> None:
    app = create_app(keyed.control, keyed.store, keyed.settings)
    operations = [(path, method) for path, item in app.openapi()["paths"].items() for method in item]
    changing = [(path, method) for path, method in operations if method not in {"get", "head", "options"}]
    assert len(changing) >= 11
    for path, method in changing:
        needed = needed_role({"type": "http", "path": path, "method": method.upper()})
        assert needed in {Role.REPORTER, Role.OPERATOR, Role.ADMIN}, path
        assert (needed is Role.REPORTER) == path.endswith(("/fixes", "/uploads", "/departures"))


def test_a_reporter_reports_and_neither_sees_nor_flies_anything(keyed: Server) -> None:
    with keyed.client(Role.OPERATOR) as operator:
        live = operator.post("/api/v1/campaigns", json=LIVE).json()["id"]
    with keyed.client(Role.REPORTER) as phone:
        fix = {"user": "u1", "lat_deg": 40.4253, "lon_deg": -86.92, "time": 1_700_000_000}
        assert phone.post(f"/api/v1/campaigns/{live}/fixes", json=[fix]).status_code == 202
        assert [phone.get(path).status_code for path in READING] == [403] * len(READING)
        for path in ("campaigns", f"campaigns/{live}/start", "emergency-stop", "drones/1/commands", "keys"):
            assert phone.post(f"/api/v1/{path}", json={}).status_code == 403
    with keyed.client(Role.VIEWER) as viewer:
        assert viewer.post(f"/api/v1/campaigns/{live}/fixes", json=[fix]).status_code == 403


def test_keys_are_made_used_and_revoked_over_rest(keyed: Server) -> None:
    with keyed.client(Role.ADMIN) as admin:
        made = admin.post("/api/v1/keys", json={"name": "bob", "role": "viewer"}).json()
        with httpx.Client(base_url=keyed.url, headers={"authorization": f"Bearer {made['key']}"}) as bob:
            assert bob.get("/api/v1/me").json()["actor"] == "bob"
            assert admin.delete(f"/api/v1/keys/{made['id']}").status_code == 204
            assert bob.get("/api/v1/me").status_code == 401
        assert admin.delete(f"/api/v1/keys/{made['id']}").status_code == 404
        assert "key" not in admin.get("/api/v1/keys").json()[0]


def test_on_loopback_without_keys_reading_is_open_and_flying_needs_the_printed_key(local: Server) -> None:
    with local.client() as client:
        assert client.get("/api/v1/me").json()["role"] == "viewer"
        assert client.post("/api/v1/campaigns", json=SMALL).status_code == 401
        key = {"authorization": "Bearer only-once"}
        assert client.post("/api/v1/campaigns", json=SMALL, headers=key).status_code == 201
        assert client.post("/api/v1/keys", json={"name": "x", "role": "admin"}, headers=key).status_code == 403


def test_another_web_page_can_neither_read_nor_fly_a_local_server(local: Server) -> None:
    with local.client() as client:
        rebound = client.get("/api/v1/drones", headers={"host": "evil.example:80"})
        forged = client.post(
            "/api/v1/emergency-stop",
            headers={"origin": "https://evil.example", "authorization": "Bearer only-once"},
        )
        own = client.post("/api/v1/emergency-stop", headers={"origin": local.url, "authorization": "Bearer only-once"})
    assert (rebound.status_code, forged.status_code, own.status_code) == (403, 403, 202)
    assert len(local.control.requests) == 1


def test_strangers_cannot_fill_the_log(keyed: Server) -> None:
    tries, begun_s = 40, time.monotonic()
    with keyed.client() as stranger:
        for _ in range(tries):
            assert stranger.post("/api/v1/emergency-stop").status_code == 401
    seconds = math.ceil(time.monotonic() - begun_s)
    assert keyed.store.journal.flush(10.0)
    refused = [event for event in keyed.store.events.find(EventFilter()) if event.kind == "api.refused"]
    assert 1 <= len(refused) <= REFUSALS_A_SECOND * (seconds + 1)
