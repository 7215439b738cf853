"""Answers read from the store, kept until somebody writes to it: pages and monitors ask the same again and again.

Sixteen clients that ask for the newest campaigns ten times a second cost sixteen queries each time, in threads that the
flight's own has to share the interpreter with. What this server writes is seen by the next request (``version`` counts
its commits); what another process writes, within :data:`KEPT_S`.
"""

import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field

from starlette.concurrency import run_in_threadpool

KEPT_S = 0.5
MOST_KEPT = 32
MOST_BYTES = 200_000  # a longer answer is not kept: few ask for it twice


@dataclass
class Remembered:
    """Bodies of answers by what was asked; of the event loop's thread only."""

    version: Callable[[], int]
    monotonic_s: Callable[[], float] = time.monotonic
    _kept: OrderedDict[Hashable, tuple[int, float, bytes]] = field(default_factory=OrderedDict)

    async def get(self, asked: Hashable, read: Callable[[], bytes]) -> bytes:
        """The answer kept under ``asked``, or what ``read`` says, in a thread beside the event loop."""
        version, now_s = self.version(), self.monotonic_s()
        known = self._kept.get(asked)
        if known is not None and known[0] == version and now_s - known[1] < KEPT_S:
            return known[2]
        body = await run_in_threadpool(read)
        if len(body) <= MOST_BYTES:
            self._kept[asked] = (version, now_s, body)  # as of before the reading: a commit meanwhile makes it old
            self._kept.move_to_end(asked)
            while len(self._kept) > MOST_KEPT:
                self._kept.popitem(last=False)
        return body
