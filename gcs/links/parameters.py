"""Which parameters tell what a vehicle will really do, and how their values are decoded.

Source: https://mavlink.io/en/services/parameter.html; PX4 puts the bytes of an integer into the float, ArduPilot casts.
"""

import math
import struct
from collections.abc import Mapping
from typing import Final

from gcs.links.modes import ARDUPILOT, PX4
from gcs.ports import VehicleLimits

REQUEST_TIMEOUT_S: Final = 1.5
MAX_REQUESTS: Final = 5
_STANDARD_GRAVITY_MPS2: Final = 9.80665

WANTED: Final[dict[str, tuple[str, ...]]] = {
    PX4: (
        "MPC_XY_VEL_MAX",
        "MPC_ACC_HOR",
        "MPC_TILTMAX_AIR",
        "COM_OF_LOSS_T",
        "COM_OBL_RC_ACT",
        "NAV_DLL_ACT",
        "COM_LOW_BAT_ACT",
        "GF_ACTION",
        "RTL_RETURN_ALT",
    ),
    ARDUPILOT: (
        "WPNAV_ACCEL",
        "ANGLE_MAX",
        "EK3_DRAG_BCOEF_X",
        "EK3_DRAG_BCOEF_Y",
        "EK3_DRAG_MCOEF",
        "GUID_TIMEOUT",
        "FS_GCS_ENABLE",
        "SYSID_MYGCS",
        "BATT_FS_LOW_ACT",
        "FENCE_ENABLE",
        "RTL_ALT",
    ),
}

RENAMED: Final = {
    "WPNAV_ACCEL": ("WP_ACC", 100.0),
    "ANGLE_MAX": ("ATC_ANGLE_MAX", 100.0),
    "RTL_ALT": ("RTL_ALT_M", 100.0),
    "SYSID_MYGCS": ("MAV_GCS_SYSID", 1.0),
}
"""ArduCopter 4.7 renamed some and gave them SI units: the new name, and how many of the old unit make a new one. Both
are asked for in turn; the value is kept under the old name in the old unit, whichever the vehicle knows."""
_OLD_NAMES: Final = {new: (old, scale) for old, (new, scale) in RENAMED.items()}

LEAN_SHARE: Final = 0.9
"""Of the lean limit counted on against drag at top speed; the rest steers. The last of it would be reached never."""
_AIR_KGPM3: Final = 1.225  # standard atmosphere at sea level, as ArduPilot's EK3_DRAG_* are defined

_INTEGER_FORMATS: Final = {1: "<B", 2: "<b", 3: "<H", 4: "<h", 5: "<I", 6: "<i"}  # MAV_PARAM_TYPE


def decode_value(value: float, param_type: int, *, bytewise: bool) -> float:
    """A PARAM_VALUE's number; ``bytewise`` as the vehicle's capability bits say."""
    if bytewise and param_type in _INTEGER_FORMATS:
        layout = _INTEGER_FORMATS[param_type]
        return float(struct.unpack_from(layout, struct.pack("<f", value))[0])
    return value


def limits_from(autopilot: str, values: Mapping[str, float]) -> VehicleLimits:
    """Speed, acceleration and time-out that the parameters read so far imply; nonsense (0, NaN) is none of them."""
    values = {name: value for name, value in values.items() if math.isfinite(value) and value > 0.0}
    if autopilot == PX4:
        return VehicleLimits(
            max_speed_mps=values.get("MPC_XY_VEL_MAX"),
            max_accel_mps2=_px4_accel_mps2(values),
            setpoint_timeout_s=values.get("COM_OF_LOSS_T"),
        )
    if autopilot == ARDUPILOT:
        return VehicleLimits(
            max_speed_mps=_ardupilot_speed_mps(values),
            max_accel_mps2=_ardupilot_accel_mps2(values),
            setpoint_timeout_s=values.get("GUID_TIMEOUT"),
        )
    return VehicleLimits()


def _px4_accel_mps2(values: Mapping[str, float]) -> float | None:
    """MPC_ACC_HOR (m/s^2), and never more than a lean of MPC_TILTMAX_AIR (degrees) gives."""
    if "MPC_ACC_HOR" not in values:
        return None
    if "MPC_TILTMAX_AIR" not in values:
        return values["MPC_ACC_HOR"]
    return min(values["MPC_ACC_HOR"], _lean_accel_mps2(values["MPC_TILTMAX_AIR"]))


def _lean_accel_mps2(lean_deg: float) -> float:
    return _STANDARD_GRAVITY_MPS2 * math.tan(math.radians(lean_deg))


def _ardupilot_accel_mps2(values: Mapping[str, float]) -> float | None:
    """GUIDED shapes velocity by WPNAV_ACCEL (cm/s^2) and can never lean further than ANGLE_MAX (centidegrees)."""
    candidates = []
    if "WPNAV_ACCEL" in values:
        candidates.append(values["WPNAV_ACCEL"] / 100.0)
    if "ANGLE_MAX" in values:
        candidates.append(_lean_accel_mps2(values["ANGLE_MAX"] / 100.0))
    return min(candidates) if candidates else None


def _ardupilot_speed_mps(values: Mapping[str, float]) -> float | None:
    """Where drag takes what the lean gives. None without EK3_DRAG_* (0, the default, is none) or ANGLE_MAX.

    No speed parameter caps a GUIDED velocity, neither WPNAV_SPEED (WP_SPD) nor LOIT_SPEED: ModeGuided's
    velaccel_control_run hands it on as it is. Drag by the estimator's own model, MCOEF v + rho v^2 / (2 BCOEF) in
    m/s^2 (AP_NavEKF3, EK3_DRAG_MCOEF in 1/s, EK3_DRAG_BCOEF_X and _Y in kg/m^2: the worse side counts).
    """
    ballistic_kgpm2 = [
        c for c in map(values.get, ("EK3_DRAG_BCOEF_X", "EK3_DRAG_BCOEF_Y")) if c is not None and c > 0.0
    ]
    linear_1ps = max(0.0, values.get("EK3_DRAG_MCOEF", 0.0))
    if "ANGLE_MAX" not in values or not (ballistic_kgpm2 or linear_1ps):
        return None
    accel_mps2 = LEAN_SHARE * _lean_accel_mps2(values["ANGLE_MAX"] / 100.0)
    if not ballistic_kgpm2:
        return accel_mps2 / linear_1ps
    quadratic_1pm = 0.5 * _AIR_KGPM3 / min(ballistic_kgpm2)
    root_1ps = math.sqrt(linear_1ps * linear_1ps + 4.0 * quadratic_1pm * accel_mps2)
    return (root_1ps - linear_1ps) / (2.0 * quadratic_1pm)


class ParameterReader:
    """Asks for the wanted parameters one at a time until each has come or has been asked for often enough."""

    def __init__(self) -> None:
        self.values: dict[str, float] = {}
        self._asked: dict[str, int] = {}
        self._due_s = float("-inf")

    def next_request(self, autopilot: str, now_s: float) -> str | None:
        """Name of the parameter to request now, or None."""
        if now_s < self._due_s:
            return None
        for name in WANTED.get(autopilot, ()):
            asked = self._asked.get(name, 0)
            if name not in self.values and asked < _most_requests(name):
                self._asked[name] = asked + 1
                self._due_s = now_s + REQUEST_TIMEOUT_S
                return RENAMED[name][0] if name in RENAMED and asked % 2 == 1 else name
        return None

    def on_value(self, name: str, value: float) -> bool:
        """Take a value in; True when it is one we wanted, and then the next may be asked at once."""
        name, scale = _OLD_NAMES.get(name, (name, 1.0))
        if name not in self._asked:
            return False
        self.values[name] = scale * value
        self._due_s = float("-inf")
        return True

    def settled(self, autopilot: str, now_s: float) -> bool:
        """Each wanted parameter has come, or its last request has run out of time."""
        open_names = [n for n in WANTED.get(autopilot, ()) if n not in self.values]
        asked_in_vain = all(self._asked.get(n, 0) >= _most_requests(n) for n in open_names)
        return autopilot in WANTED and (not open_names or (asked_in_vain and now_s >= self._due_s))

    def missing(self, autopilot: str) -> tuple[str, ...]:
        """Parameters asked for in vain."""
        wanted = WANTED.get(autopilot, ())
        return tuple(n for n in wanted if n not in self.values and self._asked.get(n, 0) >= _most_requests(n))


def _most_requests(name: str) -> int:
    return MAX_REQUESTS * (2 if name in RENAMED else 1)
