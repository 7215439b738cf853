"""The journal: what was recorded is read back, and a slow or broken store never holds up who records."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import Engine, event, text

import gcs.store.journal as journal_module
from gcs.ports import CampaignState, Event, Severity, SlotRecord, UavSlot, UserSlot
from gcs.store.engine import open_engine
from gcs.store.event_tail import EventTail
from gcs.store.journal import StoreJournal
from gcs.store.migrate import upgrade
from gcs.store.reading import EventFilter, Slots
from gcs.store.store import Store
from policy.world.metrics import Metrics

WAIT_S = 20.0
AMOUNT = st.floats(allow_nan=True, allow_infinity=False, width=32)
UAV = st.builds(UavSlot, st.integers(1, 250), AMOUNT, AMOUNT, AMOUNT, AMOUNT, AMOUNT, st.booleans())
USER = st.builds(UserSlot, st.text(max_size=8).filter(str.isprintable), AMOUNT, AMOUNT, AMOUNT, AMOUNT, st.booleans())
METRICS = st.none() | st.builds(Metrics, AMOUNT, AMOUNT, AMOUNT, AMOUNT, AMOUNT)
RECORD = st.builds(
    SlotRecord,
    st.integers(0, 5),
    st.floats(0, 1e6),
    st.lists(UAV, max_size=3).map(tuple),
    st.lists(USER, max_size=3).map(tuple),
    METRICS,
    st.none() | st.floats(0, 1e4),
)
ANY_TEXT = st.text(st.characters(), max_size=30)
EVENT = st.builds(
    Event,
    st.floats(0, 1e6),
    st.sampled_from(["plan.late", "gate.slowed"]),
    ANY_TEXT,
    st.sampled_from(Severity),
    st.none() | st.sampled_from(["a", "b"]),
    st.none() | st.integers(1, 250),
    ANY_TEXT,
    st.dictionaries(ANY_TEXT, st.none() | st.booleans() | st.floats() | ANY_TEXT | st.lists(st.floats()), max_size=3),
)
SEVERAL = settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@contextmanager
def locked(engine: Engine) -> Iterator[None]:
    """Another process holds the database: nobody else can write."""
    with engine.connect() as connection:
        connection.exec_driver_sql("BEGIN IMMEDIATE")
        yield
        connection.rollback()


@pytest.fixture
def impatient(tmp_path: Path) -> Iterator[Engine]:
    """A SQLite engine that gives up on a lock at once."""
    engine = open_engine(f"sqlite:///{tmp_path / 'impatient.sqlite3'}")
    event.listen(engine, "connect", lambda connection, _: connection.execute("PRAGMA busy_timeout=20"))
    upgrade(engine)
    yield engine
    engine.dispose()


@given(records=st.lists(RECORD, min_size=1, max_size=6))
@SEVERAL
def test_slots_are_read_back_and_the_last_telling_of_a_slot_counts(store: Store, records: list[SlotRecord]) -> None:
    campaign_id = f"c{time.monotonic_ns()}"
    for record in records:
        store.journal.record_slot(campaign_id, record)
    assert store.journal.flush(WAIT_S)
    expected = {record.slot: record for record in records}
    assert repr(list(store.slots.of(campaign_id))) == repr([expected[slot] for slot in sorted(expected)])


@given(events=st.lists(EVENT, min_size=1, max_size=8))
@SEVERAL
def test_events_are_read_back_in_order(store: Store, events: list[Event]) -> None:
    before = store.events.count(EventFilter())
    for told in events:
        store.journal.record(told)
    assert store.journal.flush(WAIT_S)
    found = store.events.find(EventFilter(), offset=before)
    assert [(e.time_s, e.kind, e.severity, e.system_id) for e in found] == [
        (e.time_s, e.kind, e.severity.value, e.system_id) for e in events
    ]
    assert store.journal.health().ok
    assert store.journal.health().lost == 0


def test_ordinary_words_are_kept_to_the_letter_and_what_databases_refuse_is_replaced(store: Store) -> None:
    store.journal.record(Event(1.0, "vehicle.text", "Arm: Größe \x00 ok", data={"speed_mps": float("nan"), "n": 3}))
    assert store.journal.flush(WAIT_S)
    (found,) = store.events.find(EventFilter(kind="vehicle.text"))
    assert found.message == "Arm: Größe � ok"
    assert found.data == {"speed_mps": None, "n": 3}


def test_recording_does_not_wait_for_a_locked_store_and_overflow_is_counted_and_told(impatient: Engine) -> None:
    tail = EventTail()
    journal = StoreJournal(impatient, tail, capacity=50)
    with locked(impatient):
        began_s = time.monotonic()
        for index in range(200):
            journal.record(Event(float(index), "plan.late", "late"))
        assert time.monotonic() - began_s < 1.0
        health = journal.health()
        assert health.lost == 150
        assert not health.ok
        assert "store.overflow" in {n.event.kind for n in tail.since(0)}
    assert journal.close(WAIT_S)
    with impatient.connect() as connection:
        kinds = connection.execute(text("SELECT kind, message FROM events ORDER BY id")).all()
    assert len(kinds) == 51
    assert kinds[-1] == ("store.recovered", "the store is back; 150 records were lost")


def test_a_failing_store_is_told_and_nothing_is_lost_once_it_is_back(impatient: Engine) -> None:
    tail = EventTail()
    journal = StoreJournal(impatient, tail)
    failed = threading.Event()
    append = tail.append

    def watch(told: Event) -> int:
        if told.kind == "store.failing":
            failed.set()
        return append(told)

    tail.append = watch  # type: ignore[method-assign]
    with locked(impatient):
        journal.record(Event(1.0, "campaign.state", "flying"))
        assert failed.wait(WAIT_S)
        assert "locked" in journal.health().error
        assert journal.health().failures >= 1
    assert journal.flush(WAIT_S)
    assert journal.health().ok
    assert journal.close(WAIT_S)
    with impatient.connect() as connection:
        assert connection.execute(text("SELECT kind FROM events ORDER BY id")).scalars().all() == [
            "campaign.state",
            "store.recovered",
        ]


def test_what_follows_from_a_record_is_told_when_it_is_written_or_the_store_is_known_to_fail(impatient: Engine) -> None:
    tail = EventTail()
    journal = StoreJournal(impatient, tail)
    may_be_told = journal.durability()
    assert may_be_told(), "nothing was recorded"
    with locked(impatient):
        journal.record(Event(1.0, "campaign.state", "flying"))
        later = journal.durability()
        seen: list[str] = []
        until_s = time.monotonic() + WAIT_S
        while not (told := later()) and time.monotonic() < until_s:
            seen += [numbered.event.kind for numbered in tail.since(0)]
        assert told
        assert not journal.health().ok, "only because the store fails"
    assert journal.flush(WAIT_S)
    assert journal.durability()()
    assert journal.close(WAIT_S)
    assert [numbered.event.kind for numbered in tail.since(0)][:2] == ["campaign.state", "store.failing"]


def test_a_write_that_takes_long_is_told_though_nobody_waits_for_it(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, may_end, commit = threading.Event(), threading.Event(), StoreJournal._commit

    def slow(self: StoreJournal, batch: Any) -> None:
        begun.set()
        assert may_end.wait(WAIT_S)
        commit(self, batch)

    monkeypatch.setattr(StoreJournal, "_commit", slow)
    monkeypatch.setattr(journal_module, "PATIENCE_S", 0.0)
    store.journal.record(Event(1.0, "a", "first"))
    assert begun.wait(WAIT_S)
    for number in range(3):
        store.journal.record(Event(2.0 + number, "b", "while the first is being written"))
    may_end.set()
    assert store.journal.flush(WAIT_S)
    assert [n.event.kind for n in store.tail.since(0)].count("store.late") == 1, "once, not at each record"


def test_an_event_is_told_after_it_is_committed(store: Store) -> None:
    """Whoever hears of an event finds it in the store through a connection of his own."""
    other = open_engine(store.engine.url.render_as_string(hide_password=False))
    told = 0
    for index in range(12):
        store.journal.record(Event(float(index), "plan.late", f"late {index}"))
        with other.connect() as connection:
            told = len(store.tail.since(0))
            kept = connection.execute(text("SELECT count(*) FROM events")).scalar_one()
        assert kept >= told
    other.dispose()


def test_a_full_disk_is_told_keeps_nobody_waiting_and_loses_nothing(tmp_path: Path) -> None:
    """SQLite itself says that the disk is full: its file may not grow any more."""
    engine = open_engine(f"sqlite:///{tmp_path / 'full.sqlite3'}")
    upgrade(engine)
    engine.dispose()
    room = {"pages": 0}
    event.listen(engine, "connect", lambda c, _: c.execute(f"PRAGMA max_page_count={room['pages'] or 1_000_000}"))
    room["pages"] = 1
    tail = EventTail()
    journal = StoreJournal(engine, tail)
    longest_s = 0.0
    for index in range(400):
        began_s = time.monotonic()
        journal.record(Event(float(index), "plan.late", "x" * 400))
        if index % 100 == 99:
            journal.settle()
        longest_s = max(longest_s, time.monotonic() - began_s)
    until_s = time.monotonic() + WAIT_S
    while journal.health().ok and time.monotonic() < until_s:
        time.sleep(0.01)
    assert "full" in journal.health().error
    assert longest_s < 1.0
    room["pages"] = 0
    engine.dispose()  # somebody made room
    assert journal.flush(WAIT_S)
    assert journal.close(WAIT_S)
    with engine.connect() as connection:
        kinds = connection.execute(text("SELECT kind FROM events ORDER BY id")).scalars().all()
    assert kinds == ["plan.late"] * 400 + ["store.recovered"]
    assert "store.failing" in {numbered.event.kind for numbered in tail.since(0)}


def test_a_record_that_no_store_takes_is_dropped_alone(store: Store) -> None:
    for told in (Event(1.0, "a", "first"), Event(2.0, "b", "huge", system_id=10**30), Event(3.0, "c", "last")):
        store.journal.record(told)
    assert store.journal.flush(WAIT_S)
    assert [e.kind for e in store.events.find(EventFilter())] == ["a", "c"]
    assert store.journal.health().lost == 1
    assert "store.refused" in {n.event.kind for n in store.tail.since(0)}


def test_closing_a_journal_whose_store_is_gone_ends_in_bounded_time(impatient: Engine) -> None:
    journal = StoreJournal(impatient, EventTail())
    with locked(impatient):
        journal.record(Event(1.0, "a", "never written"))
        began_s = time.monotonic()
        assert not journal.close(0.3)
        assert time.monotonic() - began_s < 5.0


def test_a_killed_process_leaves_whole_slots(store: Store) -> None:
    """Another engine sees committed slots while the first one is still open, as after kill -9."""
    record = SlotRecord(0, 0.0, (), (), None)
    for slot in range(30):
        store.journal.record_slot("whole", replace(record, slot=slot))
    assert store.journal.flush(WAIT_S)
    other = open_engine(store.engine.url.render_as_string(hide_password=False))
    assert [r.slot for r in Slots(other).of("whole")] == list(range(30))
    other.dispose()


def test_the_campaigns_row_follows_its_state_events(store: Store, campaign_id: str) -> None:
    data = {"state": CampaignState.FAILED, "reason": "drone 2 refused to arm"}
    store.journal.record(Event(1.0, "campaign.state", "failed", campaign_id=campaign_id, data=data))
    assert store.journal.flush(WAIT_S)
    campaign = store.campaigns.get(campaign_id)
    assert campaign is not None
    assert (campaign.state, campaign.reason) == (CampaignState.FAILED, "drone 2 refused to arm")
    assert campaign.over
