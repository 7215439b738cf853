"""Round-trip time of one vehicle's link by TIMESYNC (https://mavlink.io/en/services/timesync.html), sans-IO.

Answers are matched to requests by the time that they carry back; strangers' and broadcast answers match none.
"""

ASK_S = 0.1  # ten in a row unanswered is a dead link, though three in ten get lost on a bad one
TWICE_ABOVE = 3  # lost of the last seconds' thirty: each is asked twice, so that bad luck does not look like a cut
_KEPT = 128  # requests that may still be answered
_LATE_NS, _LATELY_NS = 1_000_000_000, 4_000_000_000
_SMOOTHING = 0.2


class LatencyMeter:
    """Asks at every tick; ``latency_s`` is smoothed and includes the wait for the tick that reads the answer."""

    def __init__(self) -> None:
        self.latency_s: float | None = None
        self._due_s = float("-inf")
        self._open: list[int] = []

    def requests_ns(self, now_s: float) -> tuple[int, ...]:
        """The times to ask with now: none, one, or two where many get lost."""
        if now_s < self._due_s - 1e-6:
            return ()
        self._due_s = now_s + ASK_S
        stamp_ns = int(now_s * 1e9) + 1  # never 0, which would read as "no time"
        lost = sum(_LATE_NS < stamp_ns - asked_ns < _LATELY_NS for asked_ns in self._open)
        answers = self.latency_s is not None
        stamps = (stamp_ns, stamp_ns + 1) if answers and lost > TWICE_ABOVE else (stamp_ns,)
        self._open = [*self._open[len(stamps) - _KEPT :], *stamps]
        return stamps

    def on_answer(self, stamp_ns: int, now_s: float) -> bool:
        """An answer carries ``stamp_ns`` back; False when we did not ask so."""
        if stamp_ns not in self._open:
            return False
        self._open.remove(stamp_ns)
        measured_s = max(0.0, now_s - stamp_ns / 1e9)
        known = self.latency_s
        self.latency_s = measured_s if known is None else known + _SMOOTHING * (measured_s - known)
        return True
