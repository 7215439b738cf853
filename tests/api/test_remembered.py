"""Answers kept until somebody writes."""

import asyncio
from collections.abc import Hashable

import httpx
import pytest
from api_server import SMALL, Server

from gcs.api.remembered import KEPT_S, MOST_BYTES, MOST_KEPT, Remembered
from gcs.ports import Event
from gcs.store.campaigns import Campaigns
from gcs.store.keys import Role


class Asked:
    """A store that counts how often it is read, and what has been written to it."""

    def __init__(self) -> None:
        self.version, self.now_s, self.reads, self.body = 0, 0.0, 0, b"short"
        self.writes_meanwhile = 0
        self.kept = Remembered(lambda: self.version, lambda: self.now_s)

    def get(self, asked: Hashable = "x") -> bytes:
        return asyncio.run(self.kept.get(asked, self._read))

    def _read(self) -> bytes:
        self.reads += 1
        self.version += self.writes_meanwhile
        return self.body


def test_the_same_question_is_read_once() -> None:
    asked = Asked()
    assert asked.get() == asked.get() == b"short"
    assert asked.reads == 1
    asked.get("another question")
    assert asked.reads == 2


def test_a_write_or_some_time_makes_it_old() -> None:
    asked = Asked()
    asked.get()
    asked.version, asked.body = 1, b"new"
    assert asked.get() == b"new"
    asked.now_s, asked.body = KEPT_S, b"written by another process"
    assert asked.get() == b"written by another process"


def test_what_was_read_while_somebody_wrote_is_read_again() -> None:
    asked = Asked()
    asked.writes_meanwhile = 1
    asked.get()
    asked.get()
    assert asked.reads == 2


def test_it_stays_small() -> None:
    asked = Asked()
    for number in range(MOST_KEPT + 1):
        asked.get(number)
    asked.get(MOST_KEPT)
    assert asked.reads == MOST_KEPT + 1
    asked.get(0)
    assert asked.reads == MOST_KEPT + 2, "the oldest one has gone"
    asked.body = bytes(MOST_BYTES + 1)
    asked.get("long"), asked.get("long")
    assert asked.reads == MOST_KEPT + 4


def test_who_writes_sees_it_in_the_next_answer(operator: httpx.Client, keyed: Server) -> None:
    assert operator.get("/api/v1/campaigns").json() == []
    made = operator.post("/api/v1/campaigns", json=SMALL).json()["id"]
    assert [one["id"] for one in operator.get("/api/v1/campaigns").json()] == [made]
    assert operator.get("/api/v1/campaigns?offset=1").json() == []
    before = operator.get("/api/v1/events?limit=1000").json()["events"]
    keyed.store.journal.record(Event(1.0, "plan.late", "the plan is late"))
    assert keyed.store.journal.flush(5.0)
    after = operator.get("/api/v1/events?limit=1000").json()["events"]
    assert [one["message"] for one in after[len(before) :]] == ["the plan is late"]
    operator.post(f"/api/v1/campaigns/{made}/start")
    assert operator.get("/api/v1/campaigns").json()[0]["state"] == "flying", "the flight's own word, not the store's"
    keyed.control.end_slot(2)
    assert operator.get("/api/v1/campaigns").json()[0]["slot"] == 2


def test_twenty_who_ask_cost_one_query(keyed: Server, operator: httpx.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    operator.post("/api/v1/campaigns", json=SMALL)
    keyed.store.journal.flush(5.0)
    reads: list[int] = []
    newest = Campaigns.newest
    monkeypatch.setattr(Campaigns, "newest", lambda *args: reads.append(1) or newest(*args))
    with keyed.client(Role.VIEWER) as viewer:
        monkeypatch.setattr("gcs.api.remembered.KEPT_S", 60.0)
        answers = {client.get("/api/v1/campaigns").text for client in (viewer, operator) * 10}
    assert len(answers) == 1
    assert len(reads) == 1
