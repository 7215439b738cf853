"""The store as one thing: opened, migrated, written through the journal, read through its tables."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from sqlalchemy import Engine

from gcs.store.answers import Answers
from gcs.store.campaigns import Campaigns
from gcs.store.commits import Commits
from gcs.store.engine import open_engine
from gcs.store.event_tail import EventTail
from gcs.store.journal import StoreJournal
from gcs.store.keys import Keys
from gcs.store.migrate import upgrade
from gcs.store.reading import Checkpoints, Events, Orders, Slots, Uploads
from gcs.store.telemetry import Telemetry


@dataclass(frozen=True)
class Store:
    """Everything that outlives the process, and the tail of events that does not."""

    engine: Engine
    tail: EventTail
    journal: StoreJournal
    campaigns: Campaigns
    events: Events
    slots: Slots
    telemetry: Telemetry
    checkpoints: Checkpoints
    orders: Orders
    uploads: Uploads
    answers: Answers
    keys: Keys
    commits: Commits

    def close(self) -> bool:
        """Write what is queued, stop the journal; False when records had to be left behind."""
        written = self.journal.close()
        self.engine.dispose()
        return written


def open_store(url: str) -> Store:
    """Open and migrate; raises StoreError with one line."""
    engine = open_engine(url)
    try:
        upgrade(engine)
    except BaseException:
        engine.dispose()  # nobody else could: its connections would stay open
        raise
    tail = EventTail()
    return Store(
        engine=engine,
        tail=tail,
        journal=StoreJournal(engine, tail),
        campaigns=Campaigns(engine),
        events=Events(engine),
        slots=Slots(engine),
        telemetry=Telemetry(engine),
        checkpoints=Checkpoints(engine),
        orders=Orders(engine),
        uploads=Uploads(engine),
        answers=Answers(engine),
        keys=Keys(engine),
        commits=Commits(engine),
    )


@contextmanager
def using_store(url: str) -> Iterator[Store]:
    """A store that is closed in the end."""
    store = open_store(url)
    try:
        yield store
    finally:
        store.close()
