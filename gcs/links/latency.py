"""Round-trip time of one vehicle's link by TIMESYNC (https://mavlink.io/en/services/timesync.html), sans-IO.

Answers are matched to requests by the time that they carry back; strangers' and broadcast answers match none.
"""

ASK_S = 0.1  # ten in a row unanswered is a dead link, though three in ten get lost on a bad one
_KEPT = 64  # requests that may still be answered
_SMOOTHING = 0.2


class LatencyMeter:
    """Asks at every tick; ``latency_s`` is smoothed and includes the wait for the tick that reads the answer."""

    def __init__(self) -> None:
        self.latency_s: float | None = None
        self._due_s = float("-inf")
        self._open: list[int] = []

    def request_ns(self, now_s: float) -> int | None:
        """The time to ask with now, or None."""
        if now_s < self._due_s - 1e-6:
            return None
        self._due_s = now_s + ASK_S
        stamp_ns = int(now_s * 1e9) + 1  # never 0, which would read as "no time"
        self._open = [*self._open[1 - _KEPT :], stamp_ns]
        return stamp_ns

    def on_answer(self, stamp_ns: int, now_s: float) -> bool:
        """An answer carries ``stamp_ns`` back; False when we did not ask so."""
        if stamp_ns not in self._open:
            return False
        self._open.remove(stamp_ns)
        measured_s = max(0.0, now_s - stamp_ns / 1e9)
        known = self.latency_s
        self.latency_s = measured_s if known is None else known + _SMOOTHING * (measured_s - known)
        return True
