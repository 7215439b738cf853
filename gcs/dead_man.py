"""The dead man's switch: when the flight loop stalls, its drones are told to stop, for a moment; then silence.

A vehicle goes on with its last velocity until its own time-out (PX4 1 s, ArduPilot 3 s and 120 m from 18 m/s,
measured). So after half a second without a tick a thread of its own repeats *zero* velocity, never an old wish, for
two and a half seconds; then it stops too, and the vehicle's failsafe takes over. It sends no heartbeats: nothing here
vouches for a loop that is dead. It cannot act while the loop hangs inside the link, or holds the interpreter's lock.
"""

import logging
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress

from gcs.ports import SafeSetpoint
from gcs.safety.gate import SealedSetpoint

logger = logging.getLogger(__name__)

HOLD_AFTER_S = 0.5
SILENT_AFTER_S = 3.0
PERIOD_S = 0.1  # of the wall clock

Send = Callable[[SafeSetpoint, float], None]


class DeadMan:
    """Between ``watch`` and ``end``; ``hands`` is held by whoever uses the link."""

    def __init__(self, now_s: Callable[[], float], send: Send) -> None:
        self._now_s, self._send = now_s, send
        self.hands = threading.Lock()
        self._newest: Sequence[SealedSetpoint] = ()
        self._fed_s = now_s()
        self._held_s = 0.0
        self._over = threading.Event()
        self._thread: threading.Thread | None = None

    def watch(self) -> None:
        """Start to watch."""
        self._over.clear()
        self._fed_s = self._now_s()
        self._thread = threading.Thread(target=self._run, name="dead man", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Stop watching: the loop ends on purpose, and the drones are left to whoever ended it."""
        self._over.set()
        if self._thread is not None:
            self._thread.join()
        self._thread = None

    def feed(self, newest: Sequence[SealedSetpoint]) -> float:
        """The loop lives; ``newest``: whom it has told something. Returns for how long they were held before, in s."""
        held_s, self._held_s = self._held_s, 0.0
        self._newest, self._fed_s = newest, self._now_s()
        return held_s

    def step(self) -> bool:
        """One look; True when holds were sent."""
        now_s = self._now_s()
        silent_s = now_s - self._fed_s
        if not HOLD_AFTER_S < silent_s < SILENT_AFTER_S or not self._newest:
            return False
        if not self.hands.acquire(blocking=False):
            return False
        try:
            if now_s - self._fed_s <= HOLD_AFTER_S:  # it came back meanwhile
                return False
            for setpoint in self._newest:
                self._send(setpoint.at_rest("the flight loop stalled"), now_s)
            self._held_s = silent_s
        finally:
            self.hands.release()
        return True

    def _run(self) -> None:
        while not self._over.wait(PERIOD_S):
            with suppress(OSError, ValueError):
                self.step()
