"""Pure updates of a vehicle's status by one decoded message each (common.xml, ardupilotmega.xml)."""

import math
from collections.abc import Callable
from typing import Any, Final

from gcs.links.modes import ARDUPILOT, PX4, describe_mode
from gcs.ports import Landed, VehicleStatus

_AUTOPILOTS: Final = {12: PX4, 3: ARDUPILOT}  # MAV_AUTOPILOT
_LANDED: Final = {1: Landed.ON_GROUND, 2: Landed.IN_AIR, 3: Landed.TAKING_OFF, 4: Landed.LANDING}
_MODE_FLAG_ARMED: Final = 128  # MAV_MODE_FLAG_SAFETY_ARMED
_GPS_BIT: Final = 1 << 5  # MAV_SYS_STATUS_SENSOR_GPS
_MOTORS_BIT: Final = 1 << 15  # MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
_UNKNOWN_VOLTAGE: Final = 65_535  # UINT16_MAX: not measured


def changed(status: VehicleStatus, **values: Any) -> VehicleStatus:
    """As ``dataclasses.replace``, which takes eight times as long: thirty times a second for each of many vehicles."""
    made = object.__new__(VehicleStatus)
    made.__dict__.update(status.__dict__, **values)
    return made


def with_heartbeat(status: VehicleStatus, message: Any, now_s: float) -> VehicleStatus:
    """HEARTBEAT: autopilot, mode, armed."""
    autopilot = _AUTOPILOTS.get(message.autopilot, "unknown")
    mode_name, mode = describe_mode(autopilot, message.custom_mode)
    armed = bool(message.base_mode & _MODE_FLAG_ARMED)
    return changed(status, autopilot=autopilot, mode=mode, mode_name=mode_name, armed=armed, heartbeat_s=now_s)


def with_position(status: VehicleStatus, message: Any, measured_s: float) -> VehicleStatus:
    """GLOBAL_POSITION_INT, measured at ``measured_s`` on our clock."""
    return changed(
        status,
        lat_deg=message.lat / 1e7,
        lon_deg=message.lon / 1e7,
        alt_amsl_m=message.alt / 1e3,
        alt_home_m=message.relative_alt / 1e3,
        vel_ned_mps=(message.vx / 100.0, message.vy / 100.0, message.vz / 100.0),
        position_s=measured_s,
    )


def _with_attitude(status: VehicleStatus, message: Any) -> VehicleStatus:
    return changed(status, yaw_rad=message.yaw % (2.0 * math.pi))


def _with_sys_status(status: VehicleStatus, message: Any) -> VehicleStatus:
    fraction = None if message.battery_remaining < 0 else message.battery_remaining / 100.0
    volts = None if message.voltage_battery == _UNKNOWN_VOLTAGE else message.voltage_battery / 1e3
    sick = message.onboard_control_sensors_enabled & ~message.onboard_control_sensors_health
    return changed(
        status,
        battery_fraction=fraction,
        battery_v=volts,
        satellites_ok=not sick & _GPS_BIT,
        motors_ok=not sick & _MOTORS_BIT,
    )


def _with_landed(status: VehicleStatus, message: Any) -> VehicleStatus:
    return changed(status, landed=_LANDED.get(message.landed_state, Landed.UNKNOWN))


def _with_home(status: VehicleStatus, message: Any) -> VehicleStatus:
    return changed(status, home_lat_deg=message.latitude / 1e7, home_lon_deg=message.longitude / 1e7)


def _with_version(status: VehicleStatus, message: Any) -> VehicleStatus:
    """AUTOPILOT_VERSION.flight_sw_version: major, minor, patch, and the kind of release in the lowest byte."""
    packed = message.flight_sw_version
    return changed(status, version=f"{packed >> 24 & 255}.{packed >> 16 & 255}.{packed >> 8 & 255}")


def _with_wind(status: VehicleStatus, message: Any) -> VehicleStatus:
    return changed(status, wind_mps=message.speed if math.isfinite(message.speed) else None)


def _with_wind_cov(status: VehicleStatus, message: Any) -> VehicleStatus:
    speed_mps = math.hypot(message.wind_x, message.wind_y)
    return changed(status, wind_mps=speed_mps if math.isfinite(speed_mps) else None)


UPDATES: Final[dict[str, Callable[[VehicleStatus, Any], VehicleStatus]]] = {
    "ATTITUDE": _with_attitude,
    "SYS_STATUS": _with_sys_status,
    "EXTENDED_SYS_STATE": _with_landed,
    "HOME_POSITION": _with_home,
    "AUTOPILOT_VERSION": _with_version,
    "WIND": _with_wind,
    "WIND_COV": _with_wind_cov,
}
"""Messages whose whole meaning is a new status."""
