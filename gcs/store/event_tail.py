"""The newest events in memory, numbered, for streams that follow them at their own pace.

A ring and not a queue per reader: a reader that is too slow sees a gap in the numbers, and nobody waits for it.
"""

import threading
from collections import Counter, deque
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice

from gcs.ports import Event

CAPACITY = 2_000


@dataclass(frozen=True)
class NumberedEvent:
    """An event with its place in the order; the first is 1."""

    sequence: int
    event: Event


class EventTail:
    """Written by any thread, read by any thread."""

    def __init__(self, capacity: int = CAPACITY) -> None:
        self._lock = threading.Lock()
        self._ring: deque[NumberedEvent] = deque(maxlen=capacity)
        self._last = 0
        self._counts: Counter[tuple[str, str]] = Counter()
        self._verdicts: dict[int, Event] = {}

    def append(self, event: Event) -> int:
        """Number the event and keep it; the oldest one falls out when the ring is full."""
        with self._lock:
            self._last += 1
            self._ring.append(NumberedEvent(self._last, event))
            self._counts[(event.kind, event.severity.value)] += 1
            if event.kind == "command.verdict" and event.system_id is not None:
                self._verdicts[event.system_id] = event
            return self._last

    @property
    def last_sequence(self) -> int:
        """Number of the newest event, 0 before the first."""
        with self._lock:
            return self._last

    def since(self, sequence: int, limit: int = CAPACITY) -> list[NumberedEvent]:
        """Events numbered above ``sequence``, oldest first, at most ``limit``."""
        with self._lock:
            missed = self._last - sequence
            skip = max(0, len(self._ring) - missed)
            return list(islice(self._ring, skip, skip + limit)) if missed > 0 else []

    def counts(self) -> Mapping[tuple[str, str], int]:
        """Events so far by (kind, severity)."""
        with self._lock:
            return dict(self._counts)

    def verdicts(self) -> Mapping[int, Event]:
        """The newest ``command.verdict`` of each vehicle."""
        with self._lock:
            return dict(self._verdicts)
