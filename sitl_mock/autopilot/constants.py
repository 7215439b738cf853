"""Numbers of the MAVLink common and ardupilotmega enumerations (https://mavlink.io/en/messages/)."""

from __future__ import annotations

from enum import IntEnum, IntFlag


class Result(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4
    IN_PROGRESS = 5
    CANCELLED = 6


class Command(IntEnum):
    """MAV_CMD, as far as the mock acts on them."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    CONDITION_YAW = 115
    DO_SET_MODE = 176
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_FLIGHTTERMINATION = 185
    DO_REPOSITION = 192
    DO_PAUSE_CONTINUE = 193
    MISSION_START = 300
    COMPONENT_ARM_DISARM = 400
    RUN_PREARM_CHECKS = 401
    GET_HOME_POSITION = 410
    GET_MESSAGE_INTERVAL = 510
    SET_MESSAGE_INTERVAL = 511
    REQUEST_MESSAGE = 512
    REQUEST_AUTOPILOT_CAPABILITIES = 520
    PREFLIGHT_CALIBRATION = 241
    PREFLIGHT_REBOOT_SHUTDOWN = 246
    DO_FENCE_ENABLE = 207
    BATTERY_RESET = 42651


class Severity(IntEnum):
    """MAV_SEVERITY."""

    EMERGENCY = 0
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6


class SystemStatus(IntEnum):
    """MAV_STATE."""

    CALIBRATING = 2
    STANDBY = 3
    ACTIVE = 4
    CRITICAL = 5


class Landed(IntEnum):
    """MAV_LANDED_STATE."""

    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


class BaseMode(IntFlag):
    """MAV_MODE_FLAG."""

    CUSTOM = 1
    AUTO = 4
    GUIDED = 8
    STABILIZE = 16
    MANUAL = 64
    ARMED = 128


class Sensor(IntFlag):
    """MAV_SYS_STATUS_SENSOR."""

    GYRO = 1
    ACCEL = 2
    MAG = 4
    PRESSURE = 8
    GPS = 32
    ATTITUDE = 2048
    YAW = 4096
    ALTITUDE = 8192
    POSITION = 16384
    MOTORS = 32768
    AHRS = 0x200000
    FENCE = 0x100000
    BATTERY = 0x2000000
    PREARM_CHECK = 0x10000000


class Ignore(IntFlag):
    """POSITION_TARGET_TYPEMASK: a set bit means that the field is not used."""

    POSITION = 0b111
    VELOCITY = 0b111 << 3
    ACCELERATION = 0b111 << 6
    FORCE = 1 << 9
    YAW = 1 << 10
    YAW_RATE = 1 << 11


class Frame(IntEnum):
    """MAV_FRAME, as far as setpoints and positions use them."""

    GLOBAL = 0
    LOCAL_NED = 1
    GLOBAL_RELATIVE_ALT = 3
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_ALT_INT = 6
    LOCAL_OFFSET_NED = 7
    BODY_NED = 8
    BODY_OFFSET_NED = 9


FORCE_MAGIC = 21196.0  # param2 of COMPONENT_ARM_DISARM that skips the checks (MAV_CMD 400)
QUADROTOR, HEXAROTOR = 2, 13  # MAV_TYPE
AUTOPILOT_COMPONENT = 1  # MAV_COMP_ID_AUTOPILOT1
MAV_TYPE_GCS = 6
