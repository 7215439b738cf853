"""Where the two autopilots differ, as data and small functions. `px4.py` and `ardupilot.py` fill it in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from sitl_mock.autopilot.parameters import Encoding, ParamTable, ParamType

if TYPE_CHECKING:
    from collections.abc import Callable

    from sitl_mock.autopilot.constants import Result
    from sitl_mock.autopilot.fence import FenceRule
    from sitl_mock.autopilot.modes import ModeTable
    from sitl_mock.physics.vehicle import VehicleType

Defaults = dict[str, tuple[ParamType, float]]


@dataclass(frozen=True, slots=True)
class ReturnPlan:
    """How the vehicle comes home and lands, from the parameters."""

    climb_to_m: float  # above home, before the way back
    speed_mps: float
    pause_s: float  # above home, before the descent
    descend_to_m: float  # fast descent down to here
    descent_mps: float
    touchdown_mps: float


@dataclass(frozen=True, slots=True)
class BatteryRule:
    """Limits of the battery failsafe; a limit of 0 is off."""

    low_v: float
    low_fraction: float
    critical_fraction: float
    low_delay_s: float
    low_mode: str | None  # mode entered when low, None for a warning only
    critical_mode: str | None


@dataclass(frozen=True, slots=True)
class LinkRule:
    """What happens when the ground station's heartbeats stop."""

    enabled: bool
    timeout_s: float
    only_system: int  # the one system id that counts, 0 for any
    mode: str
    text: str


@dataclass(frozen=True, slots=True)
class Flavour:
    """One autopilot's manners. Functions take the parameters, so that setting one changes the behaviour."""

    name: str
    autopilot_id: int  # MAV_AUTOPILOT
    modes: ModeTable
    first_mode: str
    encoding: Encoding
    capabilities: int  # MAV_PROTOCOL_CAPABILITY
    version: int  # flight_sw_version: major, minor, patch, type
    parameters: Callable[[VehicleType], Defaults]
    limits: Callable[[ParamTable, VehicleType], VehicleType]
    return_plan: Callable[[ParamTable], ReturnPlan]
    battery_rule: Callable[[ParamTable], BatteryRule]
    link_rule: Callable[[ParamTable], LinkRule]
    fence_rule: Callable[[ParamTable], FenceRule]
    unsigned: frozenset[str]  # messages that are taken without a signature where all must be signed
    default_streams_hz: dict[str, float]
    ready_after_s: float  # position estimate good after boot
    arm_refusal: Result
    arm_refusal_text: str
    takeoff_is_amsl: bool
    takeoff_switches_mode: bool  # PX4: takeoff is a mode; ArduPilot: an action inside GUIDED
    takeoff_delay_s: float  # spool-up between the order and lift-off
    mode_refusal: Result
    guided_needs_stream: bool  # PX4: setpoints at > 2 Hz for > 1 s before OFFBOARD
    setpoint_cancels_takeoff: bool  # ArduPilot: measured, see protocol notes in docs/mock.md
    setpoint_timeout_s: Callable[[ParamTable], float]
    setpoint_loss_mode: Callable[[ParamTable], str | None]  # None: stop and stay in the mode
    unknown_message_result: Result  # REQUEST_MESSAGE of one that it does not have
    idle_disarm_s: Callable[[ParamTable], float]  # armed on the ground without flying
    landed_disarm_s: float
    gps_loss_mode: str
    gps_loss_s: float
    broadcast_components: bool  # answers commands that name another component of its system (ArduPilot does)
