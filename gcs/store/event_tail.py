"""The newest events in memory, numbered, for streams that follow them at their own pace.

A ring and not a queue per reader: a reader that is too slow sees a gap in the numbers, and nobody waits for it.
An event is held back until the store has it, so that nothing is told that a killed server would forget. A store that
stalls must not blind who watches a flight: after :data:`PATIENCE_S` the event is told all the same.
"""

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import islice

from gcs.ports import Event

CAPACITY = 2_000
PATIENCE_S = 1.0


@dataclass(frozen=True)
class NumberedEvent:
    """An event with its place in the order; the first is 1."""

    sequence: int
    event: Event


class EventTail:
    """Written by any thread, read by any thread."""

    def __init__(self, capacity: int = CAPACITY, monotonic_s: Callable[[], float] = time.monotonic) -> None:
        self._lock = threading.Lock()
        self._monotonic_s = monotonic_s
        self._held: deque[tuple[int, float, Event]] = deque()  # ticket, since when
        self._tickets = 0
        self._ring: deque[NumberedEvent] = deque(maxlen=capacity)
        self._last = 0
        self._counts: Counter[tuple[str, str]] = Counter()
        self._verdicts: dict[int, Event] = {}

    def append(self, event: Event) -> int:
        """Tell an event now, and all that are held before it; the oldest one falls out when the ring is full."""
        with self._lock:
            while self._held:
                self._tell(self._held.popleft()[2])
            return self._tell(event)

    def hold(self, event: Event) -> int:
        """Keep an event back until :meth:`release` gets its ticket, or until :data:`PATIENCE_S` have passed."""
        with self._lock:
            self._tickets += 1
            self._held.append((self._tickets, self._monotonic_s(), event))
            return self._tickets

    def release(self, ticket: int | None = None) -> None:
        """Tell what was held up to ``ticket``; None: everything."""
        with self._lock:
            while self._held and (ticket is None or self._held[0][0] <= ticket):
                self._tell(self._held.popleft()[2])

    @property
    def last_sequence(self) -> int:
        """Number of the newest event told, 0 before the first."""
        with self._lock:
            self._tell_overdue()
            return self._last

    def since(self, sequence: int, limit: int = CAPACITY) -> list[NumberedEvent]:
        """Events numbered above ``sequence``, oldest first, at most ``limit``."""
        with self._lock:
            self._tell_overdue()
            missed = self._last - sequence
            skip = max(0, len(self._ring) - missed)
            return list(islice(self._ring, skip, skip + limit)) if missed > 0 else []

    def counts(self) -> Mapping[tuple[str, str], int]:
        """Events so far by (kind, severity)."""
        with self._lock:
            self._tell_overdue()
            return dict(self._counts)

    def verdicts(self) -> Mapping[int, Event]:
        """The newest ``command.verdict`` of each vehicle."""
        with self._lock:
            self._tell_overdue()
            return dict(self._verdicts)

    def _tell(self, event: Event) -> int:
        self._last += 1
        self._ring.append(NumberedEvent(self._last, event))
        self._counts[(event.kind, event.severity.value)] += 1
        if event.kind == "command.verdict" and event.system_id is not None:
            self._verdicts[event.system_id] = event
        return self._last

    def _tell_overdue(self) -> None:
        until_s = self._monotonic_s() - PATIENCE_S
        while self._held and self._held[0][1] <= until_s:
            self._tell(self._held.popleft()[2])
