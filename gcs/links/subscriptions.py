"""Message rates, asked for until they are really seen.

An acknowledged SET_MESSAGE_INTERVAL does not prove that the message comes (MAVSDK#2742), so what arrives decides.
ArduPilot sends nothing but heartbeats until asked; where the interval is refused, REQUEST_DATA_STREAM is the way.
"""

from typing import Final

from gcs.links.modes import ARDUPILOT, PX4

_COMMON: Final = {
    33: ("GLOBAL_POSITION_INT", 10.0),
    30: ("ATTITUDE", 4.0),
    1: ("SYS_STATUS", 1.0),
    147: ("BATTERY_STATUS", 1.0),
    245: ("EXTENDED_SYS_STATE", 2.0),
    242: ("HOME_POSITION", 0.5),
}
WANTED_HZ: Final[dict[str, dict[int, tuple[str, float]]]] = {
    PX4: {**_COMMON, 230: ("ESTIMATOR_STATUS", 1.0)},
    ARDUPILOT: {**_COMMON, 193: ("EKF_STATUS_REPORT", 1.0)},
}
OPTIONAL_HZ: Final[dict[str, dict[int, tuple[str, float]]]] = {
    PX4: {2: ("SYSTEM_TIME", 0.2), 231: ("WIND_COV", 0.5)},
    ARDUPILOT: {2: ("SYSTEM_TIME", 0.2), 168: ("WIND", 0.5)},
}
"""Worth having where the vehicle has it: asked for a few times, and not missed."""
ONCE: Final = {148: "AUTOPILOT_VERSION"}
OPTIONAL_TRIES: Final = 5

CHECK_S: Final = 1.0
STREAM_FALLBACK_AFTER: Final = 3  # checks in vain before the old request is used


class Subscriptions:
    """Which messages one vehicle still has to be asked for."""

    def __init__(self) -> None:
        self._seen_s: dict[str, float] = {}
        self._due_s = float("-inf")
        self._in_vain = 0
        self._tries = 0
        self._once_s, self._once_tries = float("-inf"), 0

    def on_message(self, name: str, now_s: float) -> None:
        """A message arrived."""
        self._seen_s[name] = now_s

    def due(self, autopilot: str, now_s: float) -> tuple[list[tuple[int, float]], bool]:
        """((message id, rate) to ask for now, whether to fall back to data streams as well)."""
        if now_s < self._due_s or autopilot not in WANTED_HZ:
            return [], False
        self._due_s = now_s + CHECK_S
        missing = [
            (number, rate_hz)
            for number, (name, rate_hz) in WANTED_HZ[autopilot].items()
            if now_s - self._seen_s.get(name, float("-inf")) > CHECK_S + 2.0 / rate_hz
        ]
        self._in_vain = self._in_vain + 1 if missing else 0
        fallback = bool(missing) and self._in_vain > STREAM_FALLBACK_AFTER and autopilot == ARDUPILOT
        if self._tries < OPTIONAL_TRIES:
            self._tries += 1
            optional = OPTIONAL_HZ[autopilot].items()
            missing += [(number, rate_hz) for number, (name, rate_hz) in optional if name not in self._seen_s]
        return missing, fallback

    def once(self, autopilot: str, now_s: float) -> list[int]:
        """Messages to ask for a single time now: each until it has come, or has been asked for often enough."""
        if now_s < self._once_s or autopilot not in WANTED_HZ or self._once_tries >= OPTIONAL_TRIES:
            return []
        self._once_s, self._once_tries = now_s + CHECK_S, self._once_tries + 1
        return [number for number, name in ONCE.items() if name not in self._seen_s]
