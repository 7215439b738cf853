"""When each client of the stream is told: one look at the flight for all of them, and all of a rate at the same tick.

A client that slept its own period saw a tick up to a period late, and twenty of them each asked for another one: every
tick was put into words and compared for a few. Here a client waits until its next turn (multiples of its period, the
same for all who asked for that rate) and is told the first tick that the flight makes from then on, when it is made. A
flight that stops ticking is told of too: three quarters of a period after its turn a client is told whatever there is.
"""

import asyncio
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from gcs.ports import FlightControl

LOOK_S = 0.01  # a tenth of a tick
GRACE = 0.75  # of a period: how long a turn waits for a new tick


@dataclass(eq=False)
class _Turn:
    """A client that waits: from ``from_s`` on for the next new tick, from ``until_s`` on for none."""

    wake: asyncio.Event
    from_s: float
    until_s: float


@dataclass
class Pace:
    """Of the event loop's thread only; it looks while somebody waits."""

    control: FlightControl
    monotonic_s: Callable[[], float] = time.monotonic
    _turns: set[_Turn] = field(default_factory=set)
    _looking: "asyncio.Task[None] | None" = None

    async def turn(self, rate_hz: float, wake: asyncio.Event) -> None:
        """Return at this client's next turn, or when ``wake`` is set by somebody else."""
        from_s = next_turn_s(self.monotonic_s(), rate_hz)
        waiting = _Turn(wake, from_s, from_s + GRACE / rate_hz)
        self._turns.add(waiting)
        if self._looking is None or self._looking.done():
            self._looking = asyncio.get_running_loop().create_task(self._look())
        try:
            await wake.wait()
        finally:
            self._turns.discard(waiting)

    async def _look(self) -> None:
        newest = self.control.snapshot()
        while self._turns:
            await asyncio.sleep(LOOK_S)
            before, newest, now_s = newest, self.control.snapshot(), self.monotonic_s()
            for waiting in self._turns:
                if now_s >= (waiting.from_s if newest is not before else waiting.until_s):
                    waiting.wake.set()


def next_turn_s(now_s: float, rate_hz: float) -> float:
    """The first multiple of the period after ``now_s``."""
    return (math.floor(now_s * rate_hz) + 1.0) / rate_hz
