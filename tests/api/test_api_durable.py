"""Nothing is told before it is written: over REST and over the stream, with a store that takes its time."""

import json
import time
from concurrent.futures import Future
from typing import Any

import httpx
import pytest
from api_server import SMALL, Server
from websockets.sync.client import connect

from gcs.ports import Event, OperatorRequest, RequestOutcome
from gcs.store.journal import StoreJournal
from gcs.store.keys import Role
from gcs.store.reading import EventFilter

WRITE_S = 0.08  # a write of this store: less than what an answer waits for, much more than a request takes


@pytest.fixture
def slow_store(monkeypatch: pytest.MonkeyPatch) -> None:
    commit = StoreJournal._commit

    def slow(self: StoreJournal, batch: Any) -> None:
        time.sleep(WRITE_S)  # the disk's time: what is being tested against
        commit(self, batch)

    monkeypatch.setattr(StoreJournal, "_commit", slow)


def kinds(server: Server) -> list[str]:
    return [event.kind for event in server.store.events.find(EventFilter())]


@pytest.mark.usefixtures("slow_store")
def test_the_answer_to_a_change_leaves_after_its_records(keyed: Server) -> None:
    with keyed.client(Role.ADMIN) as admin:
        assert admin.post("/api/v1/campaigns", json=SMALL).status_code == 201
        assert "campaign.created" in kinds(keyed), "answered, so it is in the store"
        assert admin.post("/api/v1/keys", json={"name": "bob", "role": "viewer"}).status_code == 201
        assert "keys.added" in kinds(keyed)


@pytest.mark.usefixtures("slow_store")
def test_an_order_reaches_the_flight_after_its_record(
    keyed: Server, operator: httpx.Client, campaign_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A server killed while a vehicle obeys must know, when it is back, what was ordered."""
    known: dict[str, list[str]] = {}
    submit = keyed.control.submit

    def noting(request: OperatorRequest) -> Future[RequestOutcome]:
        known[str(request.kind)] = kinds(keyed)
        return submit(request)

    monkeypatch.setattr(keyed.control, "submit", noting)
    for path in (f"campaigns/{campaign_id}/start", "emergency-stop", "drones/1/commands"):
        body = {"command": "hold"} if path.endswith("commands") else None
        assert operator.post(f"/api/v1/{path}", json=body).status_code in {200, 202}
    assert "api.start" in known["start"]
    assert "api.emergency_stop" in known["emergency_stop"]
    assert "api.command" in known["command"]


@pytest.mark.usefixtures("slow_store")
def test_the_stream_tells_an_event_after_it_is_written(keyed: Server) -> None:
    headers = {"authorization": f"Bearer {keyed.keys[Role.VIEWER]}"}
    url = keyed.stream_url + "?rate_hz=20&topics=events"
    with connect(url, additional_headers=headers, proxy=None) as stream:
        assert json.loads(stream.recv(10.0))["type"] == "hello"
        for number in range(3):
            keyed.store.journal.record(Event(float(number), f"test.{number}", "something happened"))
            message = json.loads(stream.recv(10.0))
            assert message["kind"] == f"test.{number}"
            assert message["kind"] in kinds(keyed), "told, so it is in the store"
