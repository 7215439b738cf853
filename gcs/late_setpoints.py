"""A setpoint is for the moment in which it was judged: one that its own tick has kept too long is never sent.

A tick can be held up after the gate has spoken: the store, another program, the machine itself. What the gate allowed
counted on the vehicle's obeying within half a second (``Envelope.reaction_s``); later the place that it was made for
is not where the vehicle is. Then a stop goes out in its place, which is always allowed, and an operator is told.
"""

from typing import Final

from gcs.safety.gate import SealedSetpoint

LATE_S: Final = 0.25  # half of what the gate counts on, so that link and vehicle have the other half
TELL_EVERY_S: Final = 10.0


class LateSetpoints:
    """Counts what was late until somebody has been told."""

    def __init__(self) -> None:
        self._count, self._worst_s, self._told_s = 0, 0.0, float("-inf")

    def in_time(self, safe: SealedSetpoint, judged_s: float, now_s: float) -> SealedSetpoint:
        """The setpoint judged at ``judged_s``, or a stop when it is too old to be sent ``now_s``."""
        age_s = now_s - judged_s
        if age_s <= LATE_S:
            return safe
        self._count, self._worst_s = self._count + 1, max(self._worst_s, age_s)
        return safe.at_rest("the flight loop was late")

    def report(self, now_s: float) -> str:
        """What an operator should know, at once and then every 10 s; empty when there is nothing."""
        if not self._count or now_s - self._told_s < TELL_EVERY_S:
            return ""
        words = (
            f"{self._count} setpoints were up to {self._worst_s:.1f} s old and not sent: their drones were told to"
            " stop; the machine is too slow or was held up"
        )
        self._count, self._worst_s, self._told_s = 0, 0.0, now_s
        return words
