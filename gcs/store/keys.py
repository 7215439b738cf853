"""API keys: made here, shown once, kept as salted hashes, compared in constant time.

A secret has 256 random bits, so a plain salted SHA-256 cannot be searched; slow hashes protect secrets that people
choose, and would cost every request tens of milliseconds.
"""

import hashlib
import hmac
import secrets
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum

from sqlalchemy import Engine, select, update
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from gcs.store.jsonable import clean_text
from gcs.store.models import KeyRow

PREFIX = "ucs"
RELOAD_S = 5.0  # a key revoked by another process stops working after this at the latest


class Role(StrEnum):
    """Who a key is for. A reporter is a phone, or who speaks for phones: it sees nothing and flies nothing."""

    REPORTER = "reporter"
    VIEWER = "viewer"
    OPERATOR = "operator"
    ADMIN = "admin"

    def allows(self, needed: "Role") -> bool:
        """Whether this role includes ``needed``."""
        return needed in _INCLUDES[self]


_INCLUDES = {
    Role.REPORTER: {Role.REPORTER},
    Role.VIEWER: {Role.VIEWER},
    Role.OPERATOR: {Role.REPORTER, Role.VIEWER, Role.OPERATOR},
    Role.ADMIN: set(Role),
}


@dataclass(frozen=True)
class KeyRecord:
    """A key without its secret."""

    id: str
    name: str
    role: Role
    created_at: datetime
    revoked_at: datetime | None


@dataclass(frozen=True)
class _Stored:
    record: KeyRecord
    salt: str
    digest: str

    def matches(self, secret: str) -> bool:
        return hmac.compare_digest(_digest(self.salt, secret), self.digest)


_NOBODY = _Stored(KeyRecord("", "", Role.VIEWER, datetime.min.replace(tzinfo=UTC), None), "00", "0" * 64)


class Keys:
    """The table of keys, with the active ones in memory."""

    def __init__(self, engine: Engine, monotonic_s: Callable[[], float] = time.monotonic) -> None:
        self._engine, self._monotonic_s = engine, monotonic_s
        self._lock = threading.Lock()
        self._active: Mapping[str, _Stored] = {}
        self._loaded_s: float | None = None

    def add(self, name: str, role: Role) -> tuple[KeyRecord, str]:
        """A new key and its text, which is never shown again."""
        key_id, secret, salt = secrets.token_hex(4), secrets.token_urlsafe(32), secrets.token_hex(16)
        digest, now = _digest(salt, secret), datetime.now(UTC)
        name = clean_text(name)
        row = KeyRow(id=key_id, name=name, role=role.value, salt=salt, digest=digest, created_at=now, revoked_at=None)
        with Session(self._engine) as session, session.begin():
            session.add(row)
        self._forget()
        return KeyRecord(key_id, name, role, now, None), f"{PREFIX}_{key_id}_{secret}"

    def revoke(self, key_id: str) -> bool:
        """False when there is no such active key."""
        found = (KeyRow.id == key_id) & KeyRow.revoked_at.is_(None)
        changed = update(KeyRow).where(found).values(revoked_at=datetime.now(UTC)).returning(KeyRow.id)
        with Session(self._engine) as session, session.begin():
            revoked = session.execute(changed).first() is not None
        self._forget()
        return revoked

    def all(self) -> Sequence[KeyRecord]:
        """Every key that ever was, oldest first."""
        with Session(self._engine) as session:
            return [_stored(row).record for row in session.scalars(select(KeyRow).order_by(KeyRow.created_at))]

    def any_active(self) -> bool:
        """Whether anybody could sign in."""
        return bool(self._current())

    def verify(self, text: str) -> KeyRecord | None:
        """The key that ``text`` is, or None."""
        prefix, _, rest = text.partition("_")
        key_id, _, secret = rest.partition("_")
        stored = self._current().get(key_id, _NOBODY)  # an unknown id costs as much as a wrong secret
        return stored.record if stored.matches(secret) and prefix == PREFIX and stored is not _NOBODY else None

    def _current(self) -> Mapping[str, _Stored]:
        with self._lock:
            now_s = self._monotonic_s()
            if self._loaded_s is None or now_s - self._loaded_s > RELOAD_S:
                self._active = self._load_or_keep()
                self._loaded_s = now_s
            return self._active

    def _load_or_keep(self) -> Mapping[str, _Stored]:
        """A store that is away for a while locks nobody out who was in."""
        try:
            return self._load()
        except SQLAlchemyError:
            if not self._active:
                raise
            return self._active

    def _load(self) -> Mapping[str, _Stored]:
        with Session(self._engine) as session:
            rows = session.scalars(select(KeyRow).where(KeyRow.revoked_at.is_(None)))
            return {row.id: _stored(row) for row in rows}

    def _forget(self) -> None:
        with self._lock:
            self._loaded_s = None


def _digest(salt: str, secret: str) -> str:
    return hashlib.sha256(bytes.fromhex(salt) + secret.encode("utf-8", "surrogatepass")).hexdigest()


def _stored(row: KeyRow) -> _Stored:
    record = KeyRecord(row.id, row.name, Role(row.role), row.created_at, row.revoked_at)
    return _Stored(record, row.salt, row.digest)
