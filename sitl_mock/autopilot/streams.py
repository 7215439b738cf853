"""Which message goes out how often. Rates are averages (SET_MESSAGE_INTERVAL), phases start when asked."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

_EPSILON_S = 1e-6
# REQUEST_DATA_STREAM groups of ArduCopter (GCS_Mavlink.cpp), as far as the mock has them.
GROUPS: dict[int, tuple[str, ...]] = {
    2: ("SYS_STATUS", "MISSION_CURRENT", "GPS_RAW_INT", "POSITION_TARGET_GLOBAL_INT", "FENCE_STATUS"),
    6: ("GLOBAL_POSITION_INT", "LOCAL_POSITION_NED"),
    10: ("ATTITUDE",),
    11: ("VFR_HUD",),
    12: ("SYSTEM_TIME", "BATTERY_STATUS", "EKF_STATUS_REPORT", "VIBRATION"),
}
ALL_GROUPS = 0


class Streams:
    """The schedule of one vehicle's telemetry."""

    def __init__(self, defaults_hz: Mapping[str, float], fastest_s: float, now_s: float = 0.0) -> None:
        """`fastest_s`: what is asked for faster is sent at this interval."""
        self._defaults_hz = dict(defaults_hz)
        self._fastest_s = fastest_s
        self._interval_s: dict[str, float] = {}
        self._due_s: dict[str, float] = {}
        self._next_s = inf
        for name, rate_hz in defaults_hz.items():
            self.set_interval(name, 1.0 / rate_hz, now_s)

    def set_interval(self, name: str, interval_s: float, now_s: float) -> None:
        """Negative stops it, 0 returns to the default rate (none if it has none)."""
        if interval_s == 0.0:
            rate_hz = self._defaults_hz.get(name, 0.0)
            interval_s = 1.0 / rate_hz if rate_hz else -1.0
        if interval_s < 0.0:
            self._interval_s.pop(name, None)
            self._due_s.pop(name, None)
        else:
            self._interval_s[name] = max(interval_s, self._fastest_s)
            self._due_s[name] = now_s
        self._next_s = min(self._due_s.values(), default=inf)

    def interval_s(self, name: str) -> float | None:
        """Seconds between two, None while it is off."""
        return self._interval_s.get(name)

    def due(self, now_s: float) -> list[str]:
        """Names that fall due by now, each once however late it is."""
        limit = now_s + _EPSILON_S
        if limit < self._next_s:
            return []
        names = [name for name, due_s in self._due_s.items() if due_s <= limit]
        for name in names:
            due_s = self._due_s[name] + self._interval_s[name]
            self._due_s[name] = due_s if due_s > limit else now_s + self._interval_s[name]
        self._next_s = min(self._due_s.values(), default=inf)
        return names


def interval_us(streams: Streams, name: str) -> int:
    """MESSAGE_INTERVAL.interval_us: -1 while it is off."""
    interval_s = streams.interval_s(name)
    return -1 if interval_s is None else round(interval_s * 1e6)
