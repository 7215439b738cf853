"""Opening a database: SQLite in WAL by default, PostgreSQL by URL; the same code above both."""

import sqlite3
from pathlib import Path
from typing import Any

from sqlalchemy import Engine, create_engine, event
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError, NoSuchModuleError

BUSY_TIMEOUT_S = 5.0  # how long SQLite waits for another writer before it calls the database locked


class StoreError(Exception):
    """The store cannot be opened: one line that says what, where and how to mend it."""


def open_engine(url: str) -> Engine:
    """An engine for ``url``; a SQLite file's folder is created."""
    try:
        parsed = make_url(url)
    except ArgumentError:
        raise StoreError("store url is none: use sqlite:///FILE or postgresql+psycopg://USER@HOST/NAME") from None
    if parsed.get_backend_name() == "sqlite":
        return _open_sqlite(url, parsed.database)
    try:
        return create_engine(_with_driver(url), pool_pre_ping=True)
    except (NoSuchModuleError, ModuleNotFoundError) as error:
        raise StoreError(
            f"store url needs a database driver: {error} (PostgreSQL: install the [scale] extra)"
        ) from None


def _with_driver(url: str) -> str:
    """postgres:// and postgresql:// mean the driver that we ship."""
    for prefix in ("postgres://", "postgresql://"):
        if url.startswith(prefix):
            return "postgresql+psycopg://" + url.removeprefix(prefix)
    return url


def _open_sqlite(url: str, database: str | None) -> Engine:
    """A file, because threads share it: an in-memory database would be another one for each."""
    if not database or database == ":memory:":
        raise StoreError("store url names no file: use sqlite:///FILE")
    try:
        Path(database).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"store folder {Path(database).parent} cannot be made: {error.strerror}") from None
    engine = create_engine(url, connect_args={"timeout": BUSY_TIMEOUT_S})
    event.listen(engine, "connect", _prepare_sqlite)
    return engine


def _prepare_sqlite(connection: Any, _record: Any) -> None:
    """WAL lets readers read while the journal writes; NORMAL survives kill -9 (a power cut may cost the newest).

    secure_delete overwrites what is deleted: places of people must not stay readable in the file.
    """
    if not isinstance(connection, sqlite3.Connection):
        return
    for pragma in ("journal_mode=WAL", "synchronous=NORMAL", "foreign_keys=ON", "secure_delete=ON"):
        connection.execute(f"PRAGMA {pragma}")
