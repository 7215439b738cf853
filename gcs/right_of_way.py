"""The flight thread goes first in an interpreter that it shares with the web side.

Python hands the interpreter on after ``sys.getswitchinterval()``, to whoever wakes first. A tick of a hundred drones is
some 25 ms of work, once a second 60: it was taken from the flight 25 times a tick, each time for as long as others
computed. So the interval is longer while the flight works, and short while it waits: it is handed the interpreter soon
after it wakes. In a call that lets go of the interpreter (NumPy's with many numbers) the flight loses it too, and asks
for it back after as long; but the web side, which answers in small pieces, lets go of it after each.
"""

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from gcs.ports import FlightClock

WAITING_S = 0.0005  # how long a busy thread keeps the flight from the interpreter when it wakes
WORKING_S = 0.08  # how long a working flight keeps all others from it: a tick's work, that of a hard one as well
_here = threading.local()  # ``holds`` in the thread that keeps it


class RightOfWay:
    """ports.FlightClock: ``clock``, for the flight thread alone; the process's switch interval is its own from then on.

    The thread that waits by it keeps the interpreter while it does not wait: here, or in :func:`giving_way`.
    """

    def __init__(self, clock: FlightClock) -> None:
        self._clock = clock

    @property
    def is_virtual(self) -> bool:
        """As the clock."""
        return self._clock.is_virtual

    def now_s(self) -> float:
        """As the clock."""
        return self._clock.now_s()

    def wait_until(self, time_s: float) -> None:
        """As the clock; meanwhile the others have the interpreter, afterwards the caller."""
        _here.holds = True
        with giving_way():
            self._clock.wait_until(time_s)


@contextmanager
def giving_way() -> Iterator[None]:
    """For a wait for other threads' work: a flight that waits keeps them from nothing. Means nothing elsewhere."""
    if not getattr(_here, "holds", False):
        yield
        return
    sys.setswitchinterval(WAITING_S)
    try:
        yield
    finally:
        sys.setswitchinterval(WORKING_S)
