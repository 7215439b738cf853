"""The journal: a bounded queue in front of a thread that writes to the store.

``record`` never waits: the flight loop calls it ten times a second. An event is told (in the event tail) when it is
written; what follows from it may be told when :meth:`StoreJournal.durability` says so. A slow or broken store makes the
queue grow and is told of; when the queue is full, records are lost, and that is counted, told at once and written when
the store is back.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

from sqlalchemy import Engine
from sqlalchemy.exc import (
    DataError,
    DBAPIError,
    IntegrityError,
    ProgrammingError,
    SQLAlchemyError,
    StatementError,
)
from sqlalchemy.orm import Session

from gcs.ports import Checkpoint, DecisionRecord, Event, SetpointSummary, Severity, SlotRecord, TelemetrySample
from gcs.right_of_way import giving_way
from gcs.store.entries import (
    CheckpointEntry,
    DecisionEntry,
    Entry,
    SetpointsEntry,
    SlotEntry,
    TelemetryEntry,
    Writer,
)
from gcs.store.event_tail import EventTail

CAPACITY = 20_000  # records; a campaign of 100 UAVs writes some 100 a second, so minutes of a stalled store
TELEMETRY_ROOM = CAPACITY // 4  # records that wait: beyond, telemetry is left out to leave room for what must be kept
BATCH = 500  # records a transaction
RETRY_S = 0.2  # first pause after a failure; doubles
RETRY_MAX_S = 5.0
SETTLE_S = 0.04  # how long the flight waits for durability: less than half a tick (100 ms)
STALLED_S = 5.0  # a write that takes longer is a failing store
PATIENCE_S = 1.0  # a write that takes longer keeps nothing from being told any more


@dataclass(frozen=True)
class JournalHealth:
    """How the store is doing. ``error`` is empty while it writes."""

    queued: int
    written: int
    lost: int
    failures: int
    error: str
    skipped: int = 0  # samples of telemetry left out while the store failed or was far behind

    @property
    def ok(self) -> bool:
        """Everything recorded is being written."""
        return not self.error


class StoreJournal:
    """ports.Journal over a database."""

    def __init__(
        self,
        engine: Engine,
        tail: EventTail,
        *,
        capacity: int = CAPACITY,
        wall: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self._engine, self._tail, self._capacity, self._wall = engine, tail, capacity, wall
        self._changed = threading.Condition()
        self._queue: deque[tuple[Entry, int]] = deque()  # with an event's ticket in the tail, else 0
        self._taken = 0  # entries in the batch being written
        self._queued = self._finished = 0  # entries ever taken in, and ever done with
        self._late_told = False
        self._written = self._lost = self._lost_untold = self._failures = self._skipped = 0
        self._error = ""
        self._busy_since_s: float | None = None  # monotonic; None while idle
        self._time_s = 0.0  # flight clock of the newest event
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True)
        self._thread.start()

    # --- for any thread, never waits on the store

    def record(self, event: Event) -> None:
        """Keep an event: in the store soon, and told then."""
        self._time_s = event.time_s
        self.put(event)

    def record_slot(self, campaign_id: str, record: SlotRecord) -> None:
        """Keep a slot of a campaign."""
        self.put(SlotEntry(campaign_id, record))

    def record_decision(self, campaign_id: str, record: DecisionRecord) -> None:
        """Keep what the policy was asked and what it answered."""
        self.put(DecisionEntry(campaign_id, record))

    def record_setpoints(self, campaign_id: str, slot: int, told: tuple[SetpointSummary, ...]) -> None:
        """Keep what the UAVs were told."""
        self.put(SetpointsEntry(campaign_id, slot, told))

    def record_telemetry(self, campaign_id: str, sample: TelemetrySample) -> None:
        """Keep what the vehicles said; left out while the store fails or is far behind, and counted."""
        with self._changed:
            behind = bool(self._error) or len(self._queue) + self._taken >= min(TELEMETRY_ROOM, self._capacity)
            self._skipped += behind
        if not behind:
            self.put(TelemetryEntry(campaign_id, sample))

    def checkpoint(self, checkpoint: Checkpoint) -> None:
        """Keep the newest one of its campaign, with the wall clock's time."""
        self.put(CheckpointEntry(checkpoint, self._wall()))

    def settle(self, timeout_s: float = SETTLE_S) -> bool:
        """Wait until what was recorded so far is written; a store that is known to fail is not waited for."""
        with self._changed:
            wanted = self._queued
            if self._error or self._late_told:
                return False
            with giving_way():
                done = self._changed.wait_for(lambda: self._finished >= wanted or bool(self._error), timeout_s)
            late = not done and not self._late_told
            self._late_told = self._late_told or late
        if late:
            self._tell_late(timeout_s)
        return done and not self._error

    def durability(self) -> Callable[[], bool]:
        """A question to ask again and again: may what follows from the records so far be told?

        True when all of them are written, and when the store fails or stalls: who flies must see what happens.
        """
        with self._changed:
            wanted = self._queued

        def may_be_told() -> bool:
            with self._changed:
                return self._finished >= wanted or bool(self._error) or self._busy_s() > PATIENCE_S

        return may_be_told

    def put(self, entry: Entry) -> None:
        """Queue any entry, or count it as lost."""
        with self._changed:
            full = len(self._queue) + self._taken >= self._capacity
            first_lost = full and self._lost_untold == 0
            ticket = self._tail.hold(entry) if isinstance(entry, Event) else 0
            if full:
                self._lost += 1
                self._lost_untold += 1
            else:
                self._queue.append((entry, ticket))
                self._queued += 1
                self._changed.notify_all()
            if full or self._error:
                self._tail.release(ticket)  # nobody knows when the store will have it
            late = self._busy_s() > PATIENCE_S and not (self._error or self._late_told)
            self._late_told = self._late_told or late
        if late:  # a flight between two changes of state waits for nothing, and must be told nevertheless
            self._tell_late(PATIENCE_S)
        if first_lost:
            self._tell("store.overflow", "the store is too slow: records are being lost", Severity.WARNING)

    def health(self) -> JournalHealth:
        """Counters, and what is wrong now."""
        with self._changed:
            error = self._error or ("" if self._thread.is_alive() else "the journal's thread has ended")
            if not error and self._busy_s() > STALLED_S:
                error = f"a write has taken more than {STALLED_S:g} s"
            if not error and self._lost_untold:
                error = f"queue of {self._capacity} records is full"
            queued = len(self._queue) + self._taken
            return JournalHealth(queued, self._written, self._lost, self._failures, error, self._skipped)

    def _busy_s(self) -> float:
        """How long the present write has taken."""
        return 0.0 if self._busy_since_s is None else time.monotonic() - self._busy_since_s

    def flush(self, timeout_s: float) -> bool:
        """Wait until everything recorded so far is written (or lost); False when that takes longer."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._queue and not self._taken, timeout_s)

    def close(self, timeout_s: float = 10.0) -> bool:
        """Write what is queued and stop; False when ``timeout_s`` was not enough."""
        done = self.flush(timeout_s)
        self._closing.set()
        with self._changed:
            self._changed.notify_all()
        self._thread.join(timeout_s)
        return done

    # --- the thread

    def _run(self) -> None:
        while not self._closing.is_set():
            batch = self._take()
            if batch:
                self._write(batch)

    def _take(self) -> list[tuple[Entry, int]]:
        with self._changed:
            self._changed.wait_for(lambda: self._queue or self._closing.is_set())
            batch = [self._queue.popleft() for _ in range(min(BATCH, len(self._queue)))]
            self._taken = len(batch)
            self._busy_since_s = time.monotonic()
            return batch

    def _write(self, batch: list[tuple[Entry, int]]) -> None:
        """Until it is written: a failing store is tried again, an entry that no store takes is dropped alone."""
        pause_s = RETRY_S
        while not self._closing.is_set():
            try:
                self._commit(batch)
            except (SQLAlchemyError, TypeError, ValueError, OverflowError) as error:
                if _is_defect(error):
                    self._write_singly(batch, error)
                    return
                self._note_failure(error)
                self._closing.wait(pause_s)
                pause_s = min(2.0 * pause_s, RETRY_MAX_S)
            else:
                self._tail.release(max(ticket for _, ticket in batch))
                self._note_written(len(batch), lost=0)
                return
        self._note_written(0, lost=len(batch))

    def _write_singly(self, batch: list[tuple[Entry, int]], error: Exception) -> None:
        if len(batch) > 1:
            for entry in batch:
                self._write([entry])
            return
        self._tell("store.refused", f"a record was refused by the store: {_first_line(error)}", Severity.WARNING)
        self._note_written(0, lost=1)

    def _commit(self, batch: list[tuple[Entry, int]]) -> None:
        now = self._wall()
        with Session(self._engine) as session, session.begin():
            writer = Writer(session, now)
            for entry, _ in batch:
                writer.write(entry)

    def _note_failure(self, error: Exception) -> None:
        with self._changed:
            first, self._error = not self._error, _first_line(error)
            self._failures += 1
        if first:
            self._tell("store.failing", f"the store does not take records: {_first_line(error)}", Severity.WARNING)

    def _note_written(self, count: int, *, lost: int) -> None:
        with self._changed:
            self._written += count
            self._finished += count + lost
            self._late_told = self._late_told and bool(self._queue)
            self._lost += lost
            self._taken -= count + lost
            self._busy_since_s = time.monotonic() if self._taken else None
            recovered = count > 0 and bool(self._error or self._lost_untold)
            lost_untold, self._lost_untold = self._lost_untold, 0 if recovered else self._lost_untold
            self._error = "" if count else self._error
            self._changed.notify_all()
        if recovered:
            self.record(self._own_event("store.recovered", f"the store is back; {lost_untold} records were lost"))

    def _tell_late(self, limit_s: float) -> None:
        self._tell("store.late", f"the store takes longer than {1e3 * limit_s:.0f} ms", Severity.CAUTION)

    def _tell(self, kind: str, message: str, severity: Severity) -> None:
        """To who follows the tail; the store itself cannot be told now."""
        self._tail.append(self._own_event(kind, message, severity))

    def _own_event(self, kind: str, message: str, severity: Severity = Severity.CAUTION) -> Event:
        return Event(self._time_s, kind, message, severity)


def _is_defect(error: Exception) -> bool:
    """The record is wrong, not the store: trying again would not help."""
    if isinstance(error, IntegrityError | DataError | ProgrammingError) or not isinstance(error, SQLAlchemyError):
        return True
    return isinstance(error, StatementError) and not isinstance(error, DBAPIError)


def _first_line(error: Exception) -> str:
    return (str(error) or type(error).__name__).splitlines()[0]
