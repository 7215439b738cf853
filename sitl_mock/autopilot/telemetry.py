"""Telemetry: each message built from the vehicle's state, wire scales at this rim only."""

from __future__ import annotations

from math import degrees, hypot, nan, pi
from typing import TYPE_CHECKING, Any

from sitl_mock.autopilot.constants import HEXAROTOR, BaseMode, Sensor, SystemStatus
from sitl_mock.autopilot.flight_commands import COMPASS_LIMIT_DEG
from sitl_mock.autopilot.modes import Behaviour
from sitl_mock.autopilot.state import PositionTarget, TakeoffTarget, Vehicle, VelocityTarget
from sitl_mock.geodesy import to_geodetic
from sitl_mock.physics.fleet import course_rad

if TYPE_CHECKING:
    from collections.abc import Callable

Values = dict[str, Any]
EPOCH_S = 1_700_000_000.0  # GPS time at boot: fixed, so that runs repeat
_EKF_GOOD = 0x33F  # EKF_STATUS_FLAGS: attitude to predicted absolute horizontal position, without the constant mode
_EKF_NO_POSITION = 0xA7  # attitude, vertical, constant position mode
_ESTIMATOR_GOOD = 0x33F
_ESTIMATOR_NO_POSITION = 0x27
_ESTIMATOR_GPS_GLITCH = 0x400
_GLITCH_RATIO = 1.5  # an innovation beyond its gate
_HEALTHY = (
    Sensor.GYRO | Sensor.ACCEL | Sensor.MAG | Sensor.PRESSURE | Sensor.GPS | Sensor.ATTITUDE | Sensor.YAW
    | Sensor.ALTITUDE | Sensor.POSITION | Sensor.MOTORS | Sensor.AHRS | Sensor.FENCE | Sensor.BATTERY
    | Sensor.PREARM_CHECK
)  # fmt: skip


def _ms(vehicle: Vehicle) -> int:
    return round(vehicle.clock_s * 1000)


def _us(vehicle: Vehicle) -> int:
    return round(vehicle.clock_s * 1e6)


def _i16(value: float) -> int:
    return max(-32768, min(32767, round(value)))


def heartbeat(vehicle: Vehicle) -> Values:
    base = vehicle.mode.base_mode | (BaseMode.ARMED if vehicle.armed else 0)
    status = SystemStatus.ACTIVE if vehicle.armed else SystemStatus.STANDBY
    if (
        vehicle.battery_stage
        or vehicle.link_lost
        or vehicle.faults.motors_out
        or (vehicle.gps_lost_s is not None and vehicle.flying)
    ):
        status = SystemStatus.CRITICAL
    elif not vehicle.armed and vehicle.now_s < 0.5 * vehicle.ready_at_s:
        status = SystemStatus.CALIBRATING
    return {
        "type": HEXAROTOR,
        "autopilot": vehicle.flavour.autopilot_id,
        "base_mode": int(base),
        "custom_mode": vehicle.mode.custom_mode,
        "system_status": int(status),
        "mavlink_version": 3,
    }


def _global_position(vehicle: Vehicle) -> Values:
    place, vel = vehicle.body.place, vehicle.body.vel_ned_mps
    known = vehicle.now_s >= vehicle.ready_at_s
    return {
        "time_boot_ms": _ms(vehicle),
        "lat": round(place.lat_deg * 1e7) if known else 0,
        "lon": round(place.lon_deg * 1e7) if known else 0,
        "alt": round(place.alt_amsl_m * 1e3),
        "relative_alt": round(vehicle.alt_home_m * 1e3),
        "vx": _i16(vel[0] * 100),
        "vy": _i16(vel[1] * 100),
        "vz": _i16(vel[2] * 100),
        "hdg": round(degrees(vehicle.body.yaw_rad) * 100) % 36000,
    }


def _local_position(vehicle: Vehicle) -> Values:
    (x, y, z), (vx, vy, vz) = vehicle.body.pos_ned_m, vehicle.body.vel_ned_mps
    return {"time_boot_ms": _ms(vehicle), "x": x, "y": y, "z": z, "vx": vx, "vy": vy, "vz": vz}


def _attitude(vehicle: Vehicle) -> Values:
    roll, pitch, yaw = vehicle.body.attitude_rad
    return {"time_boot_ms": _ms(vehicle), "roll": roll, "pitch": pitch, "yaw": (yaw + pi) % (2 * pi) - pi}


def _vfr_hud(vehicle: Vehicle) -> Values:
    north, east, down = vehicle.body.vel_ned_mps
    speed = hypot(north, east)
    return {
        "airspeed": speed,
        "groundspeed": speed,
        "heading": round(degrees(vehicle.body.yaw_rad)) % 360,
        "throttle": 50 if vehicle.armed and vehicle.flying else 0,
        "alt": vehicle.body.place.alt_amsl_m,
        "climb": -down,
    }


def _sys_status(vehicle: Vehicle) -> Values:
    battery = vehicle.body.battery
    health = _HEALTHY
    if not vehicle.ready:
        health &= ~(Sensor.PREARM_CHECK | Sensor.POSITION | Sensor.AHRS)
    if vehicle.faults.gps_lost:
        health &= ~Sensor.GPS
    if vehicle.faults.arming_denied is not None or vehicle.battery_stage:
        health &= ~Sensor.PREARM_CHECK
    if abs(vehicle.faults.compass_error_deg) > COMPASS_LIMIT_DEG:
        health &= ~Sensor.MAG
    if vehicle.faults.motors_out:
        health &= ~Sensor.MOTORS
    if vehicle.faults.cells_failed:
        health &= ~Sensor.BATTERY
    if vehicle.fence.breach:
        health &= ~Sensor.FENCE
    return {
        "onboard_control_sensors_present": int(_HEALTHY),
        "onboard_control_sensors_enabled": int(_HEALTHY),
        "onboard_control_sensors_health": int(health),
        "load": 300,
        "voltage_battery": round(battery.voltage_v * 1e3),
        "current_battery": _i16(battery.current_a * 100),
        "battery_remaining": round(battery.remaining * 100),
    }


def _battery_status(vehicle: Vehicle) -> Values:
    battery = vehicle.body.battery
    return {
        "id": 0,
        "battery_function": 1,
        "type": 1,  # lithium polymer
        "temperature": round(battery.temperature_c * 100),
        "voltages": tuple(round(v * 1e3) for v in battery.cell_v[:10]) + (65535,) * (10 - battery.cells),
        "current_battery": _i16(battery.current_a * 100),
        "current_consumed": round(battery.used_mah),
        "energy_consumed": round(battery.used_mah * vehicle.body.kind.battery_v * 3.6 / 100),  # hectojoule
        "battery_remaining": round(battery.remaining * 100),
        "charge_state": 1 + vehicle.battery_stage,
    }


def _gps_raw(vehicle: Vehicle) -> Values:
    (north, east, down), vel = vehicle.body.position.report
    place = to_geodetic(vehicle.body.pad, north, east, -down)
    lost = vehicle.faults.gps_lost
    return {
        "time_usec": _us(vehicle),
        "fix_type": 1 if lost else 6,
        "lat": round(place.lat_deg * 1e7),
        "lon": round(place.lon_deg * 1e7),
        "alt": round(place.alt_amsl_m * 1e3),
        "eph": 65535 if lost else 121,
        "epv": 65535 if lost else 200,
        "vel": round(hypot(vel[0], vel[1]) * 100),
        "cog": round(degrees(course_rad(vel[:2])) * 100) % 36000,
        "satellites_visible": 0 if lost else 10,
        "h_acc": 0 if lost else round(vehicle.body.position.accuracy_m * 1e3),
        "v_acc": 0 if lost else round(1.5e3 * vehicle.body.position.accuracy_m),
    }


def _home_position(vehicle: Vehicle) -> Values:
    home, (x, y, z) = vehicle.home, vehicle.home_ned_m
    return {
        "latitude": round(home.lat_deg * 1e7),
        "longitude": round(home.lon_deg * 1e7),
        "altitude": round(home.alt_amsl_m * 1e3),
        "x": x,
        "y": y,
        "z": z,
        "q": (1.0, 0.0, 0.0, 0.0),
        "time_usec": _us(vehicle),
    }


def _origin(vehicle: Vehicle) -> Values:
    pad = vehicle.body.pad
    return {
        "latitude": round(pad.lat_deg * 1e7),
        "longitude": round(pad.lon_deg * 1e7),
        "altitude": round(pad.alt_amsl_m * 1e3),
        "time_usec": _us(vehicle),
    }


def _ekf_status(vehicle: Vehicle) -> Values:
    return {
        "flags": _EKF_GOOD if vehicle.ready else _EKF_NO_POSITION,
        "velocity_variance": 0.02,
        "pos_horiz_variance": _GLITCH_RATIO if vehicle.body.position.doubting else 0.02,
        "pos_vert_variance": 0.01,
        "compass_variance": 0.03 + abs(vehicle.faults.compass_error_deg) / COMPASS_LIMIT_DEG,
    }


def _estimator_status(vehicle: Vehicle) -> Values:
    doubting = vehicle.body.position.doubting
    flags = _ESTIMATOR_GOOD if vehicle.ready else _ESTIMATOR_NO_POSITION
    return {
        "time_usec": _us(vehicle),
        "flags": flags | (_ESTIMATOR_GPS_GLITCH if doubting else 0),
        "vel_ratio": 0.02,
        "pos_horiz_ratio": _GLITCH_RATIO if doubting else 0.02,
        "pos_vert_ratio": 0.01,
        "mag_ratio": 0.03 + abs(vehicle.faults.compass_error_deg) / COMPASS_LIMIT_DEG,
        "hagl_ratio": nan,
        "tas_ratio": nan,
        "pos_horiz_accuracy": 0.5,
        "pos_vert_accuracy": 0.8,
    }


def _target_echo(vehicle: Vehicle) -> Values:
    """POSITION_TARGET_GLOBAL_INT: what is being followed."""
    target = vehicle.target
    values: Values = {"time_boot_ms": _ms(vehicle), "coordinate_frame": 5, "type_mask": 0xDFF}
    if isinstance(target, VelocityTarget):
        vx, vy, vz = target.vel_ned_mps
        return values | {"type_mask": 3527, "vx": vx, "vy": vy, "vz": vz}
    if isinstance(target, PositionTarget | TakeoffTarget):
        north, east, down = target.pos_ned_m
        place = to_geodetic(vehicle.body.pad, north, east, -down)
        lat, lon = round(place.lat_deg * 1e7), round(place.lon_deg * 1e7)
        return values | {"type_mask": 0xDF8, "lat_int": lat, "lon_int": lon, "alt": place.alt_amsl_m}
    return values


def _target_echo_local(vehicle: Vehicle) -> Values:
    """POSITION_TARGET_LOCAL_NED: the same in metres from the origin."""
    target = vehicle.target
    values: Values = {"time_boot_ms": _ms(vehicle), "coordinate_frame": 1, "type_mask": 0xDFF}
    if isinstance(target, VelocityTarget):
        vx, vy, vz = target.vel_ned_mps
        return values | {"type_mask": 3527, "vx": vx, "vy": vy, "vz": vz}
    if isinstance(target, PositionTarget | TakeoffTarget):
        x, y, z = target.pos_ned_m
        return values | {"type_mask": 0xDF8, "x": x, "y": y, "z": z}
    return values


def _altitude(vehicle: Vehicle) -> Values:
    amsl = vehicle.body.place.alt_amsl_m
    return {
        "time_usec": _us(vehicle),
        "altitude_monotonic": amsl,
        "altitude_amsl": amsl,
        "altitude_local": -vehicle.body.down_m,
        "altitude_relative": vehicle.alt_home_m,
        "altitude_terrain": nan,
        "bottom_clearance": nan,
    }


def _version(vehicle: Vehicle) -> Values:
    flavour = vehicle.flavour
    return {
        "capabilities": flavour.capabilities,
        "flight_sw_version": flavour.version,
        "board_version": 0,
        "flight_custom_version": tuple(b"sitlmock"),
        "uid": vehicle.system,
        "uid2": tuple(vehicle.system.to_bytes(18, "big")),
    }


def _mission_current(vehicle: Vehicle) -> Values:
    running = vehicle.mode.behaviour is Behaviour.MISSION and vehicle.armed
    return {"seq": vehicle.mission_item, "mission_state": 3 if running else 2, "total": 0}


def _system_time(vehicle: Vehicle) -> Values:
    return {"time_unix_usec": round((EPOCH_S + vehicle.clock_s) * 1e6), "time_boot_ms": _ms(vehicle)}


def _fence_status(vehicle: Vehicle) -> Values:
    fence = vehicle.fence
    return {
        "breach_status": int(fence.breach != 0),
        "breach_count": fence.count,
        "breach_type": int(fence.breach),
        "breach_time": round(fence.at_s * 1e3),
    }


BUILDERS: dict[str, Callable[[Vehicle], Values]] = {
    "ALTITUDE": _altitude,
    "ATTITUDE": _attitude,
    "AUTOPILOT_VERSION": _version,
    "BATTERY_STATUS": _battery_status,
    "EKF_STATUS_REPORT": _ekf_status,
    "ESTIMATOR_STATUS": _estimator_status,
    "CURRENT_EVENT_SEQUENCE": lambda vehicle: {"sequence": vehicle.events.sequence},
    "FENCE_STATUS": _fence_status,
    "EXTENDED_SYS_STATE": lambda vehicle: {"landed_state": int(vehicle.landed_state)},
    "GLOBAL_POSITION_INT": _global_position,
    "GPS_GLOBAL_ORIGIN": _origin,
    "GPS_RAW_INT": _gps_raw,
    "HEARTBEAT": heartbeat,
    "HOME_POSITION": _home_position,
    "LOCAL_POSITION_NED": _local_position,
    "MISSION_CURRENT": _mission_current,
    "POSITION_TARGET_GLOBAL_INT": _target_echo,
    "POSITION_TARGET_LOCAL_NED": _target_echo_local,
    "SYSTEM_TIME": _system_time,
    "SYS_STATUS": _sys_status,
    "TIMESYNC": lambda vehicle: {"tc1": 0, "ts1": round(vehicle.clock_s * 1e9)},
    "VFR_HUD": _vfr_hud,
    "VIBRATION": lambda vehicle: {"time_usec": _us(vehicle)},
}
# Not sent before the position estimate is good: PX4 publishes no invalid topics; ArduPilot has no home yet.
_AFTER_READY = {
    "px4": {"HOME_POSITION", "GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "GPS_GLOBAL_ORIGIN"},
    "ardupilot": {"HOME_POSITION", "LOCAL_POSITION_NED", "GPS_GLOBAL_ORIGIN"},
}
_ONLY = {
    "px4": {"ESTIMATOR_STATUS", "ALTITUDE", "CURRENT_EVENT_SEQUENCE"},
    "ardupilot": {"EKF_STATUS_REPORT", "FENCE_STATUS"},
}


def available(vehicle: Vehicle, name: str) -> bool:
    """Whether this flavour has the message."""
    foreign = any(name in names for flavour, names in _ONLY.items() if flavour != vehicle.flavour.name)
    return name in BUILDERS and not foreign


def ready(vehicle: Vehicle, name: str) -> bool:
    """Whether the flavour has the message and there is something to say in it now."""
    early = vehicle.now_s < vehicle.ready_at_s and name in _AFTER_READY[vehicle.flavour.name]
    return available(vehicle, name) and not early
