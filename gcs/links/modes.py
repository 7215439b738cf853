"""What each autopilot's custom_mode means to us, and which mode we ask for.

Sources: PX4 ``px4_custom_mode.h`` (main mode in bits 16-23, sub mode in 24-31); ArduPilot ``Copter/mode.h``.
"""

from typing import Final

from gcs.ports import FlightMode

PX4: Final = "px4"
ARDUPILOT: Final = "ardupilot"

_PX4_AUTO: Final = 4
_PX4_NAMES: Final[dict[tuple[int, int], tuple[str, FlightMode]]] = {
    (1, 0): ("MANUAL", FlightMode.PILOT),
    (2, 0): ("ALTCTL", FlightMode.PILOT),
    (3, 0): ("POSCTL", FlightMode.PILOT),
    (5, 0): ("ACRO", FlightMode.PILOT),
    (6, 0): ("OFFBOARD", FlightMode.GUIDED),
    (7, 0): ("STABILIZED", FlightMode.PILOT),
    (_PX4_AUTO, 1): ("AUTO.READY", FlightMode.HOLD),
    (_PX4_AUTO, 2): ("AUTO.TAKEOFF", FlightMode.TAKEOFF),
    (_PX4_AUTO, 3): ("AUTO.LOITER", FlightMode.HOLD),
    (_PX4_AUTO, 4): ("AUTO.MISSION", FlightMode.PILOT),
    (_PX4_AUTO, 5): ("AUTO.RTL", FlightMode.RETURN),
    (_PX4_AUTO, 6): ("AUTO.LAND", FlightMode.LAND),
}

_ARDUCOPTER_NAMES: Final[dict[int, tuple[str, FlightMode]]] = {
    0: ("STABILIZE", FlightMode.PILOT),
    1: ("ACRO", FlightMode.PILOT),
    2: ("ALT_HOLD", FlightMode.PILOT),
    3: ("AUTO", FlightMode.PILOT),
    4: ("GUIDED", FlightMode.GUIDED),
    5: ("LOITER", FlightMode.PILOT),
    6: ("RTL", FlightMode.RETURN),
    7: ("CIRCLE", FlightMode.PILOT),
    9: ("LAND", FlightMode.LAND),
    16: ("POSHOLD", FlightMode.PILOT),
    17: ("BRAKE", FlightMode.HOLD),
    20: ("GUIDED_NOGPS", FlightMode.PILOT),
    21: ("SMART_RTL", FlightMode.RETURN),
}

# DO_SET_MODE parameters 2 and 3. ArduPilot holds in BRAKE: LOITER would follow a throttle stick that may not exist.
MODE_PARAMETERS: Final[dict[str, dict[FlightMode, tuple[float, float]]]] = {
    PX4: {FlightMode.GUIDED: (6.0, 0.0), FlightMode.HOLD: (4.0, 3.0)},
    ARDUPILOT: {FlightMode.GUIDED: (4.0, 0.0), FlightMode.HOLD: (17.0, 0.0)},
}


def describe_mode(autopilot: str, custom_mode: int) -> tuple[str, FlightMode]:
    """The vehicle's own name of a mode and what it means to us; unknown modes belong to the pilot."""
    if autopilot == PX4:
        main, sub = (custom_mode >> 16) & 0xFF, (custom_mode >> 24) & 0xFF
        key = (main, sub if main == _PX4_AUTO else 0)
        return _PX4_NAMES.get(key, (f"PX4 {main}.{sub}", FlightMode.PILOT))
    if autopilot == ARDUPILOT:
        return _ARDUCOPTER_NAMES.get(custom_mode, (f"MODE {custom_mode}", FlightMode.PILOT))
    return (f"MODE {custom_mode}", FlightMode.UNKNOWN)
