"""PX4 1.15's manners. Defaults from its parameter definitions, verdicts from Commander and its failsafes."""

from __future__ import annotations

from dataclasses import replace
from math import degrees, radians
from typing import TYPE_CHECKING

from sitl_mock.autopilot.constants import Result
from sitl_mock.autopilot.fence import FenceRule
from sitl_mock.autopilot.flavour import BatteryRule, Defaults, Flavour, LinkRule, ReturnPlan
from sitl_mock.autopilot.modes import PX4_MODES, ModeTable
from sitl_mock.autopilot.parameters import Encoding, ParamTable, ParamType

if TYPE_CHECKING:
    from sitl_mock.physics.vehicle import VehicleType

_I32, _F = ParamType.INT32, ParamType.REAL32
# COM_OBL_RC_ACT: what follows when setpoints stop (commander_params.yaml).
_OFFBOARD_LOSS = {0: "POSCTL", 1: "ALTCTL", 2: "MANUAL", 3: "AUTO.RTL", 4: "AUTO.LAND", 5: "AUTO.LOITER"}
_DATALINK_LOSS = {1: "AUTO.LOITER", 2: "AUTO.RTL", 3: "AUTO.LAND"}  # NAV_DLL_ACT

_STOCK: Defaults = {
    "BAT1_N_CELLS": (_I32, 6),
    "BAT_CRIT_THR": (_F, 0.07),
    "BAT_EMERGEN_THR": (_F, 0.05),
    "BAT_LOW_THR": (_F, 0.15),
    "CAL_ACC0_ID": (_I32, 1310988),
    "CAL_GYRO0_ID": (_I32, 1310988),
    "CAL_MAG0_ID": (_I32, 197388),
    "COM_ARM_WO_GPS": (_I32, 1),
    "COM_DISARM_LAND": (_F, 2.0),
    "COM_DISARM_PRFLT": (_F, 10.0),
    "COM_DL_LOSS_T": (_I32, 10),
    "COM_LOW_BAT_ACT": (_I32, 0),
    "COM_OBL_RC_ACT": (_I32, 0),
    "COM_OF_LOSS_T": (_F, 1.0),
    "COM_RCL_EXCEPT": (_I32, 0),
    "COM_RC_IN_MODE": (_I32, 3),
    "COM_TAKEOFF_ACT": (_I32, 0),
    "GF_ACTION": (_I32, 2),
    "GF_MAX_HOR_DIST": (_F, 0.0),
    "GF_MAX_VER_DIST": (_F, 0.0),
    "MAV_SYS_ID": (_I32, 1),
    "MAV_TYPE": (_I32, 2),
    "MIS_TAKEOFF_ALT": (_F, 2.5),
    "MPC_LAND_ALT1": (_F, 10.0),
    "MPC_LAND_SPEED": (_F, 0.7),
    "MPC_TKO_SPEED": (_F, 1.5),
    "MPC_XY_CRUISE": (_F, 5.0),
    "MPC_XY_P": (_F, 0.95),
    "MPC_XY_VEL_MAX": (_F, 12.0),
    "MPC_Z_V_AUTO_DN": (_F, 1.5),
    "MPC_Z_V_AUTO_UP": (_F, 3.0),
    "NAV_ACC_RAD": (_F, 10.0),
    "NAV_DLL_ACT": (_I32, 0),
    "NAV_RCL_ACT": (_I32, 2),
    "RTL_CONE_ANG": (_I32, 45),
    "RTL_DESCEND_ALT": (_F, 30.0),
    "RTL_LAND_DELAY": (_F, 0.0),
    "RTL_RETURN_ALT": (_F, 60.0),
    "RTL_TYPE": (_I32, 0),
    "SYS_AUTOSTART": (_I32, 4001),
}


def _parameters(kind: VehicleType) -> Defaults:
    """The stock set with this airframe's limits, as its builder sets them (18 m/s needs MPC_XY_VEL_MAX)."""
    own: Defaults = {
        "BAT1_CAPACITY": (_F, kind.battery_mah),
        "BAT1_N_CELLS": (_I32, max(1, round(kind.battery_v / 3.7))),
        "MPC_ACC_HOR": (_F, kind.max_accel_mps2),
        "MPC_ACC_UP_MAX": (_F, kind.max_accel_z_mps2),
        "MPC_JERK_MAX": (_F, kind.max_jerk_mps3),
        "MPC_TILTMAX_AIR": (_F, degrees(kind.max_lean_rad)),
        "MPC_XY_CRUISE": (_F, 0.55 * kind.max_speed_mps),
        "MPC_XY_VEL_MAX": (_F, kind.max_speed_mps),
        "MPC_Z_VEL_MAX_DN": (_F, kind.descent_mps),
        "MPC_Z_VEL_MAX_UP": (_F, kind.climb_mps),
        "MPC_Z_V_AUTO_DN": (_F, kind.descent_mps),
        "MPC_Z_V_AUTO_UP": (_F, kind.climb_mps),
        "MPC_TKO_SPEED": (_F, kind.climb_mps),
    }
    return {**_STOCK, **own}


def _limits(params: ParamTable, kind: VehicleType) -> VehicleType:
    """MPC_XY_VEL_MAX (at most 20) truncates every horizontal velocity (mc_pos_control's limits)."""
    return replace(
        kind,
        max_speed_mps=min(max(params["MPC_XY_VEL_MAX"], 0.0), 20.0),
        max_accel_mps2=min(max(params["MPC_ACC_HOR"], 2.0), 15.0),
        max_jerk_mps3=min(max(params["MPC_JERK_MAX"], 0.5), 500.0),
        max_lean_rad=radians(min(max(params["MPC_TILTMAX_AIR"], 20.0), 89.0)),
        climb_mps=min(max(params["MPC_Z_VEL_MAX_UP"], 0.5), 8.0),
        descent_mps=min(max(params["MPC_Z_VEL_MAX_DN"], 0.5), 4.0),
    )


def _return_plan(params: ParamTable) -> ReturnPlan:
    """Return mode (rtl_params): climb, way back, descent to RTL_DESCEND_ALT, landing."""
    return ReturnPlan(
        climb_to_m=params["RTL_RETURN_ALT"],
        speed_mps=min(params["MPC_XY_CRUISE"], params["MPC_XY_VEL_MAX"]),
        pause_s=max(params["RTL_LAND_DELAY"], 0.0),
        descend_to_m=params["MPC_LAND_ALT1"],
        descent_mps=params["MPC_Z_V_AUTO_DN"],
        touchdown_mps=params["MPC_LAND_SPEED"],
    )


def _battery_rule(params: ParamTable) -> BatteryRule:
    """Charge thresholds; COM_LOW_BAT_ACT 0 warns, 2 lands when critical, 3 returns when critical."""
    action = {2: "AUTO.LAND", 3: "AUTO.RTL"}.get(int(params["COM_LOW_BAT_ACT"]))
    return BatteryRule(0.0, params["BAT_LOW_THR"], params["BAT_CRIT_THR"], 0.0, None, action)


def _link_rule(params: ParamTable) -> LinkRule:
    """NAV_DLL_ACT is off by default; any ground station's heartbeat counts."""
    action = _DATALINK_LOSS.get(int(params["NAV_DLL_ACT"]))
    text = "Connection to ground station lost"
    return LinkRule(action is not None, params["COM_DL_LOSS_T"], 0, action or "AUTO.LOITER", text)


def _fence_rule(params: ParamTable) -> FenceRule:
    """GF_ACTION 0 none, 1 warning, 2 hold, 3 return, 4 terminate, 5 land; uploaded fences count always."""
    action = int(params["GF_ACTION"])
    return FenceRule(
        enabled=action != 0,
        max_alt_m=params["GF_MAX_VER_DIST"],
        max_distance_m=params["GF_MAX_HOR_DIST"],
        polygons=True,
        mode={2: "AUTO.LOITER", 3: "AUTO.RTL", 5: "AUTO.LAND"}.get(action),
        terminates=action == 4,
    )


# MISSION_FLOAT, MISSION_INT, COMMAND_INT, PARAM_ENCODE_BYTEWISE, FTP excluded, SET_ATTITUDE_TARGET,
# SET_POSITION_TARGET_LOCAL and _GLOBAL, FLIGHT_TERMINATION, MAVLINK2, FENCE, RALLY.
_CAPABILITIES = 1 | 4 | 8 | 16 | 128 | 256 | 2048 | 8192 | 16384 | 32768

PX4 = Flavour(
    name="px4",
    autopilot_id=12,
    modes=ModeTable(PX4_MODES),
    first_mode="AUTO.LOITER",
    encoding=Encoding.BYTEWISE,
    capabilities=_CAPABILITIES,
    version=1 << 24 | 15 << 16 | 4 << 8 | 255,
    parameters=_parameters,
    limits=_limits,
    return_plan=_return_plan,
    battery_rule=_battery_rule,
    link_rule=_link_rule,
    fence_rule=_fence_rule,
    unsigned=frozenset({"HEARTBEAT", "RADIO_STATUS"}),  # docs.px4.io, MAVLink message signing (PX4 1.17)
    default_streams_hz={  # MAVLINK_MODE_NORMAL, configure_streams_to_default (mavlink_main.cpp)
        "ALTITUDE": 1.0,
        "ATTITUDE": 15.0,
        "BATTERY_STATUS": 0.5,
        "CURRENT_EVENT_SEQUENCE": 0.2,
        "ESTIMATOR_STATUS": 0.5,
        "EXTENDED_SYS_STATE": 1.0,
        "GLOBAL_POSITION_INT": 5.0,
        "GPS_RAW_INT": 1.0,
        "HOME_POSITION": 0.5,
        "LOCAL_POSITION_NED": 1.0,
        "POSITION_TARGET_GLOBAL_INT": 1.0,
        "SYSTEM_TIME": 1.0,
        "SYS_STATUS": 1.0,
        "VFR_HUD": 4.0,
    },
    ready_after_s=10.0,
    arm_refusal=Result.TEMPORARILY_REJECTED,
    arm_refusal_text="Arming denied: Resolve system health failures first",
    takeoff_is_amsl=True,
    takeoff_switches_mode=True,
    takeoff_delay_s=1.0,  # COM_SPOOLUP_TIME
    mode_refusal=Result.TEMPORARILY_REJECTED,
    guided_needs_stream=True,
    setpoint_cancels_takeoff=False,
    setpoint_timeout_s=lambda params: max(params["COM_OF_LOSS_T"], 0.1),
    setpoint_loss_mode=lambda params: _OFFBOARD_LOSS.get(int(params["COM_OBL_RC_ACT"]), "AUTO.LOITER"),
    unknown_message_result=Result.DENIED,
    idle_disarm_s=lambda params: params["COM_DISARM_PRFLT"],
    landed_disarm_s=2.0,  # COM_DISARM_LAND
    gps_loss_mode="AUTO.LAND",
    gps_loss_s=5.0,
    broadcast_components=False,
)
