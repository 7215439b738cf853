"""ArduCopter 4.5's manners. "Measured" was seen on its own simulation; the rest names its source file."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, radians
from typing import TYPE_CHECKING

from sitl_mock.autopilot.constants import Result
from sitl_mock.autopilot.fence import FenceRule
from sitl_mock.autopilot.flavour import BatteryRule, Defaults, Flavour, LinkRule, ReturnPlan
from sitl_mock.autopilot.modes import ARDUPILOT_MODES, ModeTable
from sitl_mock.autopilot.parameters import Encoding, ParamTable, ParamType

if TYPE_CHECKING:
    from sitl_mock.physics.vehicle import VehicleType

_I8, _I16, _I32, _F = ParamType.INT8, ParamType.INT16, ParamType.INT32, ParamType.REAL32
_BATTERY_ACTIONS = {1: "LAND", 2: "RTL", 3: "RTL", 4: "RTL", 5: "LAND"}  # BATT_FS_LOW_ACT

# Defaults of ArduCopter 4.5 (Parameters.cpp, AC_WPNav, AC_PosControl, AP_BattMonitor).
_STOCK: Defaults = {
    "ARMING_CHECK": (_I32, 1),
    "BATT_CRT_MAH": (_F, 0),
    "BATT_CRT_VOLT": (_F, 0),
    "BATT_FS_CRT_ACT": (_I8, 0),
    "BATT_FS_LOW_ACT": (_I8, 0),
    "BATT_LOW_MAH": (_F, 0),
    "BATT_LOW_TIMER": (_I8, 10),
    "BATT_LOW_VOLT": (_F, 10.5),
    "BATT_MONITOR": (_I8, 4),
    "DISARM_DELAY": (_I8, 10),
    "EK3_DRAG_BCOEF_X": (_F, 0),
    "EK3_DRAG_BCOEF_Y": (_F, 0),
    "EK3_DRAG_MCOEF": (_F, 0),
    "FENCE_ACTION": (_I8, 1),
    "FENCE_ALT_MAX": (_F, 100),
    "FENCE_ENABLE": (_I8, 0),
    "FENCE_RADIUS": (_F, 300),
    "FENCE_TYPE": (_I8, 7),
    "FRAME_CLASS": (_I8, 1),
    "FS_EKF_ACTION": (_I8, 1),
    "FS_GCS_ENABLE": (_I8, 0),
    "FS_GCS_TIMEOUT": (_F, 5),
    "FS_THR_ENABLE": (_I8, 0),
    "GPS_TYPE": (_I8, 1),
    "GUID_OPTIONS": (_I32, 0),
    "GUID_TIMEOUT": (_F, 3),
    "LAND_ALT_LOW": (_I16, 1000),
    "LAND_SPEED": (_I16, 50),
    "LAND_SPEED_HIGH": (_I16, 0),
    "LOIT_SPEED": (_F, 1250),
    "PILOT_TKOFF_ALT": (_F, 0),
    "PSC_JERK_XY": (_F, 5),
    "PSC_POSXY_P": (_F, 1),
    "PSC_VELXY_P": (_F, 2),
    "RTL_ALT": (_I32, 1500),
    "RTL_ALT_FINAL": (_I16, 0),
    "RTL_LOIT_TIME": (_I32, 5000),
    "RTL_SPEED": (_I16, 0),
    "SYSID_MYGCS": (_I16, 255),
    "WPNAV_RADIUS": (_F, 200),
    "WPNAV_SPEED": (_F, 1000),
}


def _parameters(kind: VehicleType) -> Defaults:
    """The stock set with this airframe's limits, as its builder would set them (units: cm, cdeg, mAh)."""
    own: Defaults = {
        "ANGLE_MAX": (_I16, round(degrees(kind.max_lean_rad) * 100)),
        "BATT_CAPACITY": (_I32, kind.battery_mah),
        "PSC_JERK_XY": (_F, kind.max_jerk_mps3),
        "WPNAV_ACCEL": (_F, kind.max_accel_mps2 * 100),
        "WPNAV_ACCEL_Z": (_F, kind.max_accel_z_mps2 * 100),
        "WPNAV_SPEED_DN": (_F, kind.descent_mps * 100),
        "WPNAV_SPEED_UP": (_F, kind.climb_mps * 100),
    }
    return {**_STOCK, **own}


def _limits(params: ParamTable, kind: VehicleType) -> VehicleType:
    """Lean and acceleration limit the motion; WPNAV_SPEED does not cap a GUIDED velocity (measured)."""
    return replace(
        kind,
        max_lean_rad=radians(min(max(params["ANGLE_MAX"], 1000.0), 8000.0) / 100),
        max_accel_mps2=min(max(params["WPNAV_ACCEL"], 50.0), 1000.0) / 100,
        max_jerk_mps3=min(max(params["PSC_JERK_XY"], 1.0), 20.0),
        max_accel_z_mps2=min(max(params["WPNAV_ACCEL_Z"], 50.0), 500.0) / 100,
    )


def _return_plan(params: ParamTable) -> ReturnPlan:
    """RTL and LAND (mode_rtl.cpp, mode_land.cpp): way back, pause, descent, slow last metres."""
    return ReturnPlan(
        climb_to_m=params["RTL_ALT"] / 100,
        speed_mps=(params["RTL_SPEED"] or params["WPNAV_SPEED"]) / 100,
        pause_s=params["RTL_LOIT_TIME"] / 1000,
        descend_to_m=params["LAND_ALT_LOW"] / 100,
        descent_mps=(params["LAND_SPEED_HIGH"] or params["WPNAV_SPEED_DN"]) / 100,
        touchdown_mps=params["LAND_SPEED"] / 100,
    )


def _battery_rule(params: ParamTable) -> BatteryRule:
    """Voltage below BATT_LOW_VOLT for BATT_LOW_TIMER, or charge below BATT_LOW_MAH (AP_BattMonitor)."""
    capacity = max(params["BATT_CAPACITY"], 1.0)
    return BatteryRule(
        low_v=params["BATT_LOW_VOLT"],
        low_fraction=params["BATT_LOW_MAH"] / capacity,
        critical_fraction=params["BATT_CRT_MAH"] / capacity,
        low_delay_s=params["BATT_LOW_TIMER"],
        low_mode=_BATTERY_ACTIONS.get(int(params["BATT_FS_LOW_ACT"])),
        critical_mode=_BATTERY_ACTIONS.get(int(params["BATT_FS_CRT_ACT"])),
    )


def _link_rule(params: ParamTable) -> LinkRule:
    """Off by default; counts the heartbeats of SYSID_MYGCS only (events.cpp)."""
    action = {5: "LAND", 7: "BRAKE"}.get(int(params["FS_GCS_ENABLE"]), "RTL")
    timeout_s, ground = params["FS_GCS_TIMEOUT"], int(params["SYSID_MYGCS"])
    return LinkRule(params["FS_GCS_ENABLE"] != 0, timeout_s, ground, action, "GCS Failsafe")


def _fence_rule(params: ParamTable) -> FenceRule:
    """FENCE_TYPE bits: 1 height, 2 circle, 4 polygons; FENCE_ACTION 0 report, 2 land, 4 brake, else return."""
    kinds = int(params["FENCE_TYPE"])
    action = int(params["FENCE_ACTION"])
    return FenceRule(
        enabled=params["FENCE_ENABLE"] != 0,
        max_alt_m=params["FENCE_ALT_MAX"] if kinds & 1 else 0.0,
        max_distance_m=params["FENCE_RADIUS"] if kinds & 2 else 0.0,
        polygons=bool(kinds & 4),
        mode={0: None, 2: "LAND", 4: "BRAKE"}.get(action, "RTL"),
    )


# MISSION_FLOAT, PARAM_FLOAT, MISSION_INT, COMMAND_INT, SET_POSITION_TARGET_LOCAL and _GLOBAL,
# FLIGHT_TERMINATION, MAVLINK2, MISSION_FENCE, MISSION_RALLY, PARAM_ENCODE_C_CAST (GCS_Common.cpp).
_CAPABILITIES = 1 | 2 | 4 | 8 | 128 | 256 | 2048 | 8192 | 16384 | 32768 | 131072

ARDUPILOT = Flavour(
    name="ardupilot",
    autopilot_id=3,
    modes=ModeTable(ARDUPILOT_MODES),
    first_mode="STABILIZE",
    encoding=Encoding.C_CAST,
    capabilities=_CAPABILITIES,
    version=4 << 24 | 5 << 16 | 6 << 8 | 255,
    parameters=_parameters,
    limits=_limits,
    return_plan=_return_plan,
    battery_rule=_battery_rule,
    link_rule=_link_rule,
    fence_rule=_fence_rule,
    unsigned=frozenset({"RADIO_STATUS"}),  # GCS_Signing.cpp accept_list
    default_streams_hz={"TIMESYNC": 0.1},  # measured: nothing but these until asked
    ready_after_s=41.0,  # measured: "EKF3 IMU0 is using GPS"
    arm_refusal=Result.FAILED,
    arm_refusal_text="Arm: Need Position Estimate",
    takeoff_is_amsl=False,
    takeoff_switches_mode=False,
    takeoff_delay_s=4.0,  # measured
    mode_refusal=Result.FAILED,
    guided_needs_stream=False,
    setpoint_cancels_takeoff=True,
    setpoint_timeout_s=lambda params: max(params["GUID_TIMEOUT"], 0.1),
    setpoint_loss_mode=lambda _: None,
    unknown_message_result=Result.FAILED,
    idle_disarm_s=lambda params: params["DISARM_DELAY"],
    landed_disarm_s=2.0,  # measured
    gps_loss_mode="LAND",
    gps_loss_s=8.0,  # measured
    broadcast_components=True,
)
