"""What a vehicle has got of what we send, told by its own clock, sans-IO.

Whether its setpoint stream was cut cannot be seen from here: answers that are late or lost on the way down look the
same as requests that never went up, and a cut of hardly more than the vehicle's time-out hides behind the delay. But
each answer to a time request (TIMESYNC, ten a second, beside the setpoints) says by the vehicle's clock when it got
which request. Between two of them it got none that we know of; an answer that comes late may still fill that.
"""

from bisect import bisect_left
from itertools import pairwise

from gcs.ports import Silence

WORTH_TELLING_S = 0.4  # below half of the shortest time-out in use (PX4's COM_OF_LOSS_T, 1 s)
_KEPT_S = 10.0
_REBOOT_BACKSTEP_S = 3.0


class UplinkMeter:
    """Of one vehicle, over all links to it."""

    def __init__(self) -> None:
        self._got: list[tuple[float, float]] = []  # its time, our time of asking; by its time
        self.reached_s: float | None = None
        self.silences: tuple[Silence, ...] = ()

    def on_answer(self, vehicle_s: float, asked_s: float) -> None:
        """It got at ``vehicle_s``, its time, what we sent at ``asked_s``, ours."""
        newest = self.reached_s is None or asked_s > self.reached_s  # an answer held back for seconds is no reboot
        if newest and self._got and vehicle_s < self._got[-1][0] - _REBOOT_BACKSTEP_S:
            self._got, self.silences = [], ()  # it began anew, and so do its times
        self.reached_s = asked_s if newest else self.reached_s
        late = bool(self._got) and vehicle_s < self._got[-1][0]
        gap_s = vehicle_s - self._got[-1][0] if self._got else 0.0
        self._got.insert(bisect_left(self._got, (vehicle_s, asked_s)), (vehicle_s, asked_s))
        while self._got[-1][0] - self._got[0][0] > _KEPT_S:
            del self._got[0]
        if late or gap_s >= WORTH_TELLING_S or self.silences:
            self.silences = tuple(
                Silence(after[0] - before[0], after[1])
                for before, after in pairwise(self._got)
                if after[0] - before[0] >= WORTH_TELLING_S
            )
