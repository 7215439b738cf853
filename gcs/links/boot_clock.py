"""When something was measured, on our clock, from the vehicle's own time since boot.

A packet that a router held back for 10 s must not make a vehicle "jump" (mavlink-router#457): the vehicle's stamp says
how old it is. The least delay seen gives the offset between the clocks; it is let rise slowly, for drift. A vehicle's
clock that stood still for a while (a simulator on a busy machine) would seem late for hours; but what it answers to a
time request it says after we have asked, and that bounds the offset from below, whatever delays the answer.
"""

_DRIFT_PER_S = 1e-4  # 100 ppm: worse than a flight controller's crystal
_ONE_CLOCK_S = 1.0  # an answer whose time is further from the newest stamp is not by the clock of the stamps
_REBOOT_BACKSTEP_S = 3.0
_REBOOT_MESSAGES = 5  # so many in a row from an earlier boot time are a reboot, fewer are latecomers


class BootClock:
    """Offset between one vehicle's boot time and ours."""

    def __init__(self) -> None:
        self._offset_s: float | None = None
        self._last_boot_s = float("-inf")
        self._last_now_s = 0.0
        self._backsteps = 0
        self.reboots = 0

    def measured_s(self, boot_s: float, now_s: float) -> float | None:
        """Our time of a measurement stamped ``boot_s`` and received ``now_s``; None when older than the newest."""
        if boot_s < self._last_boot_s:
            if boot_s < self._last_boot_s - _REBOOT_BACKSTEP_S:
                self._backsteps += 1
            if self._backsteps < _REBOOT_MESSAGES:
                return None
            self.reboots += 1
            self._offset_s = None
        self._backsteps = 0
        delay_s = now_s - boot_s
        if self._offset_s is None:
            self._offset_s = delay_s
        else:
            drift_s = max(0.0, now_s - self._last_now_s) * _DRIFT_PER_S
            self._offset_s = min(delay_s, self._offset_s + drift_s)
        self._last_boot_s, self._last_now_s = boot_s, now_s
        return boot_s + self._offset_s

    def answered(self, boot_s: float, asked_s: float) -> None:
        """The vehicle said ``boot_s`` in answer to what we asked at ``asked_s``: its clock showed that no earlier."""
        if self._offset_s is not None and abs(boot_s - self._last_boot_s) <= _ONE_CLOCK_S:
            self._offset_s = max(self._offset_s, asked_s - boot_s)
