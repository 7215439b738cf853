"""How often this process has written to the store, for who keeps what was read from it."""

import threading
from typing import Any

from sqlalchemy import Connection, Engine, event

_MARK = "gcs_committed"


class Commits:
    """A number that has grown by the time that a commit through ``engine`` returns to who made it."""

    def __init__(self, engine: Engine) -> None:
        self._lock = threading.Lock()
        self._count = 0
        event.listen(engine, "commit", self._begins)
        event.listen(engine, "checkin", self._ended)

    @property
    def count(self) -> int:
        """So many so far; what another process wrote is not among them."""
        return self._count

    def _begins(self, connection: Connection) -> None:
        """SQLAlchemy tells before the database commits: who counted now would call old what is read meanwhile new."""
        connection.info[_MARK] = True

    def _ended(self, _dbapi_connection: Any, record: Any) -> None:
        """The connection is given back, which sessions and ``engine.begin()`` do within the commit."""
        if record.info.pop(_MARK, False):
            with self._lock:
                self._count += 1
