"""Answers kept by Idempotency-Key: a request that comes again gets the first one's answer and acts no second time."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from sqlalchemy import ColumnElement, Engine, delete, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from gcs.store.jsonable import clean_text
from gcs.store.models import AnswerRow

KEPT = timedelta(hours=24)


@dataclass(frozen=True)
class Answer:
    """``status`` is None while the first request is being worked on, and for ever when the server died over it."""

    request: str
    status: int | None
    body: str


@dataclass(frozen=True)
class Answers:
    """The table; a row is there before its request acts."""

    engine: Engine

    def claim(self, actor: str, key: str, request: str) -> Answer | None:
        """None: the key is new and ours now. Otherwise what is known of the request that had it first."""
        now, actor = datetime.now(UTC), clean_text(actor)[:128]
        row = AnswerRow(actor=actor, key=key, request=request, status=None, body=None, created_at=now)
        try:
            with Session(self.engine) as session, session.begin():
                session.execute(delete(AnswerRow).where(AnswerRow.created_at < now - KEPT))
                session.add(row)
        except IntegrityError:
            return self._get(actor, key) or Answer(request, None, "")
        return None

    def settle(self, actor: str, key: str, status: int, body: str) -> None:
        """Keep the answer."""
        changed = update(AnswerRow).where(*_found(clean_text(actor)[:128], key)).values(status=status, body=body)
        with Session(self.engine) as session, session.begin():
            session.execute(changed)

    def give_up(self, actor: str, key: str) -> None:
        """The request came to nothing: it may be tried again under the same key."""
        with Session(self.engine) as session, session.begin():
            session.execute(delete(AnswerRow).where(*_found(clean_text(actor)[:128], key)))

    def _get(self, actor: str, key: str) -> Answer | None:
        with Session(self.engine) as session:
            row = session.get(AnswerRow, (actor, key))
            return None if row is None else Answer(row.request, row.status, row.body or "")


def _found(actor: str, key: str) -> tuple[ColumnElement[bool], ColumnElement[bool]]:
    return AnswerRow.actor == actor, AnswerRow.key == key
