"""Wipes places when their time is over, while the server runs."""

import threading
from datetime import UTC, datetime, timedelta

from sqlalchemy.exc import SQLAlchemyError

from gcs.ports import Event, Severity
from gcs.store.privacy import campaigns_to_wipe, wipe_places
from gcs.store.store import Store

EVERY_S = 3600.0


class Housekeeper:
    """At the start and every hour, in a thread of its own."""

    def __init__(self, store: Store, keep_places_days: float, every_s: float = EVERY_S) -> None:
        self._store, self._keep, self._every_s = store, timedelta(days=keep_places_days), every_s
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="housekeeper", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End after the campaign at hand."""
        self._over.set()
        self._thread.join(10.0)

    def _run(self) -> None:
        while not self._over.is_set():
            try:
                self.work()
            except SQLAlchemyError as error:  # a store that is away is tried again in an hour
                words = str(error).splitlines()[0]
                self._record("privacy.failed", f"places could not be wiped: {words}", Severity.CAUTION)
            self._over.wait(self._every_s)

    def work(self) -> int:
        """Wipe what is due; how many campaigns."""
        due = campaigns_to_wipe(self._store.engine, datetime.now(UTC) - self._keep)
        for campaign_id in due:
            wipe_places(self._store.engine, campaign_id)
            self._record("privacy.wiped", "the places of its users were wiped", Severity.INFO, campaign_id)
        return len(due)

    def _record(self, kind: str, message: str, severity: Severity, campaign_id: str | None = None) -> None:
        self._store.journal.record(Event(0.0, kind, message, severity, campaign_id, actor="housekeeper"))
