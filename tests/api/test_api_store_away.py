"""The store is away: every answer says so, none is a defect of the server, and flying goes on."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from api_server import LIVE, SMALL, Server, serving

from gcs.api.settings import ApiSettings
from gcs.store import engine
from gcs.store.keys import Role
from gcs.store.store import Store, using_store

FIX = {"user": "u1", "lat_deg": 40.4253, "lon_deg": -86.92, "time": 1_700_000_000}
BODIES = {
    "/api/v1/campaigns": SMALL,
    "/api/v1/drones/{system_id}/commands": {"command": "hold"},
    "/api/v1/campaigns/{campaign_id}/fixes": [FIX],
    "/api/v1/keys": {"name": "bob", "role": "viewer"},
}


@contextmanager
def away(store: Store, folder: Path) -> Iterator[None]:
    """The folder of the database is gone for a while; connections that were open are no more."""
    hidden = folder.with_name("hidden")
    store.engine.dispose()
    folder.rename(hidden)
    try:
        yield
    finally:
        store.engine.dispose()
        hidden.rename(folder)


def operations(server: Server) -> list[tuple[str, str]]:
    with server.client() as client:
        paths = client.get("/openapi.json").json()["paths"]
    return [(method.upper(), path) for path, item in paths.items() for method in item]


def test_no_answer_is_a_defect_while_the_store_is_away(server_store: Store, keyed: Server, tmp_path: Path) -> None:
    with keyed.client(Role.ADMIN) as admin:
        live = admin.post("/api/v1/campaigns", json=LIVE).json()["id"]
        everything = operations(keyed)
        with away(server_store, tmp_path):
            statuses = {
                operation: admin.request(operation[0], filled(operation[1], live), json=BODIES.get(operation[1]))
                for operation in everything
            }
        told = {operation: answer.status_code for operation, answer in statuses.items()}
        assert {status for status in told.values() if status >= 500} == {503}, told
        needs_the_store = [operation for operation, status in told.items() if status == 503]
        assert len(needs_the_store) >= 10, told
        for operation in needs_the_store:
            assert statuses[operation].headers["content-type"] == "application/problem+json" or "readyz" in operation[1]
        assert told[("GET", "/healthz")] == 200
        assert told[("GET", "/api/v1/drones")] == 200, "who flies still sees the drones"
        assert told[("POST", "/api/v1/emergency-stop")] == 202, "and stops them"
        assert admin.get("/api/v1/campaigns").status_code == 200, "back again"


def filled(path: str, campaign_id: str) -> str:
    names = {"campaign_id": campaign_id, "system_id": "1"}
    return "/".join(names.get(part[1:-1], "1") if part.startswith("{") else part for part in path.split("/"))


def test_a_key_that_nobody_can_check_is_not_called_wrong(server_store: Store, tmp_path: Path) -> None:
    """Nobody has been let in yet, so the keys are not known."""
    folder = tmp_path / "page"
    with serving(server_store, ApiSettings(host="0.0.0.0", dashboard=folder)) as server:
        server_store.keys.revoke("none")  # forget what is known of the keys
        with away(server_store, tmp_path), server.client(Role.ADMIN) as admin:
            answer = admin.post("/api/v1/emergency-stop")
        assert (answer.status_code, answer.headers["retry-after"]) == (503, "5")
        assert "store does not answer" in answer.json()["detail"]
        assert server.control.requests == []


def test_a_locked_store_is_read_and_says_that_it_takes_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """SQLite's readers do not wait for its writer; a writer gives up after a while, and the client is told."""
    monkeypatch.setattr(engine, "BUSY_TIMEOUT_S", 0.02)
    with using_store(f"sqlite:///{tmp_path / 'locked.sqlite3'}") as store:
        settings = ApiSettings(host="0.0.0.0", dashboard=tmp_path / "none")
        with serving(store, settings) as server, server.client(Role.OPERATOR) as operator:
            with store.engine.connect() as other:
                other.exec_driver_sql("BEGIN IMMEDIATE")
                assert operator.get("/api/v1/campaigns").status_code == 200
                refused = operator.post("/api/v1/campaigns", json=SMALL)
                other.rollback()
            assert (refused.status_code, "locked" in refused.json()["detail"]) == (503, True)
            assert operator.post("/api/v1/campaigns", json=SMALL).status_code == 201
