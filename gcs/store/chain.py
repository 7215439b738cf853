"""The audit log as a hash chain: each event's digest covers its content and the digest of the one before.

Changing, removing or slipping in an event breaks every digest after it. Cutting the end off leaves a shorter chain
that is whole in itself: who wants to notice keeps the newest digest elsewhere (``gcs audit verify`` prints it).
"""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC

from sqlalchemy import Engine, select, text
from sqlalchemy.orm import Session

from gcs.store.models import EventRow

GENESIS = "0" * 64
PAGE = 2_000  # rows read at once while verifying
LOCK_KEY = 0x75_63_73  # PostgreSQL advisory lock: one writer of the chain at a time


@dataclass(frozen=True)
class ChainReport:
    """``events`` chained ones checked; ``broken_id`` the first event that does not fit, or None."""

    events: int
    unchained: int  # written before the log was a chain
    head: str
    broken_id: int | None = None
    head_seen: bool = True  # the digest that was asked for is in the chain


def digest_of(previous: str, row: EventRow) -> str:
    """SHA-256 over the digest before and every column but the id, which the database gives."""
    content = [
        row.recorded_at.astimezone(UTC).isoformat(timespec="microseconds"),
        row.time_s,
        row.kind,
        row.severity,
        row.message,
        row.campaign_id,
        row.system_id,
        row.actor,
        row.data,
    ]
    text_ = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256((previous + text_).encode()).hexdigest()


def newest_digest(session: Session) -> str:
    """What the next event hangs on to; on PostgreSQL other writers wait until this transaction ends."""
    if session.get_bind().dialect.name == "postgresql":
        session.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": LOCK_KEY})
    found = session.scalar(select(EventRow.digest).where(EventRow.digest.is_not(None)).order_by(EventRow.id.desc()))
    return found or GENESIS


def verify_chain(engine: Engine, head: str | None = None) -> ChainReport:
    """Check every event in order; ``head``: a digest noted earlier, which must still be in the chain."""
    previous, count, unchained, seen = GENESIS, 0, 0, head is None
    for row in _rows(engine):
        if row.digest is None and count == 0:
            unchained += 1
            continue
        if row.digest != digest_of(previous, row):
            return ChainReport(count, unchained, previous, row.id, seen)
        previous, count = row.digest, count + 1
        seen = seen or previous == head
    return ChainReport(count, unchained, previous, None, seen)


def _rows(engine: Engine) -> Iterable[EventRow]:
    after = 0
    while True:
        with Session(engine, expire_on_commit=False) as session:
            page = list(session.scalars(select(EventRow).where(EventRow.id > after).order_by(EventRow.id).limit(PAGE)))
        yield from page
        if len(page) < PAGE:
            return
        after = page[-1].id
