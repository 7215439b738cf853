"""The guard that no policy reads the future: a sample is there only once its slot is reached.

The look-ahead must predict where users go; a planner that holds a feed gets :class:`FutureAccessError`
for anything later than the present slot.
"""

from typing import Protocol

import numpy as np

from policy.mobility.traces import UserTraces
from policy.world.arrays import FloatArray


class FutureAccessError(RuntimeError):
    """Someone asked for a user position that is not known yet: a defect in the asker."""


class UserFeed(Protocol):
    """Users' places as far as they are known."""

    @property
    def latest(self) -> int:
        """The newest sample that may be read."""

    def positions(self, sample: int) -> FloatArray:
        """[M, 2] east, north metres at ``sample``; raises :class:`FutureAccessError` beyond ``latest``."""


class TraceFeed:
    """Recorded or synthetic users, revealed as the campaign's slots are reached."""

    def __init__(self, traces: UserTraces) -> None:
        """Sample 0 is known from the start."""
        self._traces = traces
        self._latest = 0

    @property
    def user_ids(self) -> tuple[str, ...]:
        """M ids, in the order of the positions' first axis."""
        return self._traces.user_ids

    @property
    def num_users(self) -> int:
        """M."""
        return self._traces.num_users

    @property
    def latest(self) -> int:
        """The newest sample that may be read."""
        return self._latest

    def reach(self, slot: int) -> None:
        """The campaign has reached ``slot``: reveal samples up to it. Time never runs backwards."""
        if slot >= self._traces.num_samples:
            last = self._traces.num_samples - 1
            raise IndexError(f"{self._traces.source}: slot {slot} reached, the last sample is {last}")
        self._latest = max(self._latest, slot)

    def positions(self, sample: int) -> FloatArray:
        """[M, 2]; a copy, so that no reader can change the record."""
        if sample < 0:
            raise IndexError(f"sample {sample}: samples count from 0")
        if sample > self._latest:
            raise FutureAccessError(f"sample {sample} asked in slot {self._latest}: users' future is not known")
        return np.array(self._traces.pos_enu_m[sample], dtype=np.float64)

    def as_places(self) -> "TracePlaces":
        """What the simulated world holds: it may take the next step, one at a time."""
        return TracePlaces(self)


class TracePlaces:
    """The world's own view of a feed: asking for the next sample makes its slot reached."""

    def __init__(self, feed: TraceFeed) -> None:
        """Shares ``feed``'s progress: what the world has reached, readers of the feed may read."""
        self._feed = feed

    def positions(self, sample: int) -> FloatArray:
        """[M, 2] at ``sample``, which is known already or the very next one."""
        if sample == self._feed.latest + 1:
            self._feed.reach(sample)
        return self._feed.positions(sample)
