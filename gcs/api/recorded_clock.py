"""One time axis for a recorded campaign: seconds since its first record, launch and way home included. Pure.

By the flight clock, on which slots, telemetry and events agree; by the wall clock where a server was started anew in
flight, whose flight clock begins at 0 again.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from typing import Protocol

import numpy as np

from gcs.store.reading import SlotTime
from gcs.store.telemetry import SampleTime

DIGITS = 2


class Moment(Protocol):
    """When something was recorded."""

    @property
    def time_s(self) -> float: ...

    @property
    def recorded_at(self) -> datetime: ...


@dataclass(frozen=True)
class RecordedClock:
    """``by_wall``: which clock counts; ``begin_s`` on it; ``length_s`` until the last record."""

    by_wall: bool
    begin_s: float
    length_s: float

    def at_s(self, moments: Sequence[Moment]) -> list[float]:
        """Of moments in the order of recording: never back, and within the recording."""
        if not moments:
            return []
        since_s = np.array([self._clock_s(one) for one in moments]) - self.begin_s
        return [round(float(t), DIGITS) for t in np.maximum.accumulate(np.clip(since_s, 0.0, self.length_s))]

    def _clock_s(self, moment: Moment) -> float:
        return moment.recorded_at.timestamp() if self.by_wall else moment.time_s


def recorded_clock(
    slots: Sequence[SlotTime], samples: Sequence[SampleTime], otherwise: Sequence[Moment] = ()
) -> RecordedClock:
    """From the ends of the slots and the times of the telemetry; from ``otherwise`` where there are none.

    One of all at least, or everything is at 0.
    """
    moments: list[Moment] = [*slots, *samples] or [*otherwise]
    by_wall = any(_goes_back([one.time_s for one in told]) for told in (slots, samples))
    by_wall = by_wall or not (slots or samples)  # what is told of a campaign that never launched has no flight clock
    told_s = [one.recorded_at.timestamp() if by_wall else one.time_s for one in moments] or [0.0]
    return RecordedClock(by_wall, min(told_s), max(told_s) - min(told_s))


def _goes_back(times_s: Sequence[float]) -> bool:
    return any(b <= a for a, b in pairwise(times_s))
