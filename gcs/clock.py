"""Clocks of the flight loop: the wall clock, or a simulated clock that the mock fleet keeps (lock-step)."""

import json
import socket
import time

LOCKSTEP_TIMEOUT_S = 60.0
"""A simulator that does not answer for this long on the wall clock is dead or stuck."""


class ClockError(RuntimeError):
    """The simulated clock is gone; one line that says why."""


class RealClock:
    """Wall time since construction, ``speedup`` times as fast."""

    is_virtual = False

    def __init__(self, speedup: float = 1.0) -> None:
        if not speedup > 0.0:
            raise ValueError(f"speedup must be positive, not {speedup}")
        self._speedup = speedup
        self._begun_s = time.monotonic()

    def now_s(self) -> float:
        """Seconds since the clock was made, scaled."""
        return (time.monotonic() - self._begun_s) * self._speedup

    def wait_until(self, time_s: float) -> None:
        """Sleep; a time that has passed returns at once."""
        left_s = (time_s - self.now_s()) / self._speedup
        if left_s > 0.0:
            time.sleep(left_s)


class LockstepClock:
    """Simulated time: the fleet flies only while the loop waits, so nothing depends on the machine's speed.

    After an answer every datagram of the time passed lies in our sockets' buffers. ``speedup`` None runs as fast
    as possible, otherwise waits are paced against the wall clock.
    """

    is_virtual = True

    def __init__(self, address: tuple[str, int], speedup: float | None = None) -> None:
        try:
            self._socket = socket.create_connection(address, timeout=LOCKSTEP_TIMEOUT_S)
        except OSError as error:
            raise ClockError(
                f"no lock-step clock at {address[0]}:{address[1]} ({error}); is the mock running?"
            ) from error
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._reader = self._socket.makefile("rb")
        self._speedup = speedup
        self._begun_s = time.monotonic()
        self._now_s = 0.0

    def now_s(self) -> float:
        """The simulation's time."""
        return self._now_s

    def wait_until(self, time_s: float) -> None:
        """Let the fleet fly until ``time_s``; an earlier time than now is answered with the present one."""
        if self._speedup is not None:
            left_s = time_s / self._speedup - (time.monotonic() - self._begun_s)
            if left_s > 0.0:
                time.sleep(left_s)
        if time_s > self._now_s:
            self._now_s = self._advance(time_s)

    def close(self) -> None:
        """Hang up; the simulator ends."""
        self._reader.close()
        self._socket.close()

    def _advance(self, time_s: float) -> float:
        try:
            self._socket.sendall(b'{"advance_to_s": %.6f}\n' % time_s)
            line = self._reader.readline()
        except OSError as error:
            raise ClockError(f"the lock-step clock stopped answering at {self._now_s:.1f} s ({error})") from error
        if not line:
            raise ClockError(f"the lock-step clock hung up at {self._now_s:.1f} s; see the mock's own messages")
        try:
            return float(json.loads(line)["now_s"])
        except (ValueError, KeyError, TypeError) as error:
            raise ClockError(f"the lock-step clock answered {line[:80]!r}, not a time") from error
