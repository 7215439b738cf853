"""Commands that fly: arming, takeoff, modes, places, speeds, missions."""

from __future__ import annotations

from math import isfinite, radians

from sitl_mock.autopilot import missions, setpoints
from sitl_mock.autopilot.constants import FORCE_MAGIC, Command, Frame, Result, Severity
from sitl_mock.autopilot.modes import Behaviour, Mode
from sitl_mock.autopilot.orders import DONE, Handler, Order, Verdict
from sitl_mock.autopilot.state import PositionTarget, TakeoffTarget, Vehicle
from sitl_mock.geodesy import Geodetic, plausible, to_ned_m

_REBOOT_DELAY_S = 0.2  # the acknowledgement goes out first
_GYRO_S = 2.0
COMPASS_LIMIT_DEG = 30.0
_PX4_REFUSAL = "Arming denied: Resolve system health failures first"
_RELATIVE = {Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT}


def _arm_disarm(vehicle: Vehicle, order: Order) -> Verdict:
    forced = order[2] == FORCE_MAGIC
    if order[1] not in (0.0, 1.0):
        return Verdict(Result.UNSUPPORTED if vehicle.flavour.name == "ardupilot" else Result.DENIED)
    if order[1] == 1.0:
        return _arm(vehicle, forced=forced)
    if vehicle.armed and vehicle.flying and not forced:
        return Verdict(vehicle.flavour.arm_refusal, "Disarming denied: not landed")
    if vehicle.armed:
        vehicle.disarm("Disarming motors" if vehicle.flavour.name == "ardupilot" else "Disarmed by external command")
    return DONE


def _broken(vehicle: Vehicle) -> str | None:
    """The fault, sensor or motor that forbids arming."""
    if vehicle.faults.arming_denied is not None:
        return vehicle.faults.arming_denied
    if vehicle.faults.motors_out:
        return "Arm: Motors: Check frame class and type" if vehicle.flavour.name == "ardupilot" else _PX4_REFUSAL
    if abs(vehicle.faults.compass_error_deg) > COMPASS_LIMIT_DEG:
        return "Arm: Compass not healthy" if vehicle.flavour.name == "ardupilot" else _PX4_REFUSAL
    return None


def arming_refusal(vehicle: Vehicle) -> str | None:
    """Why it cannot be armed now, None if it can."""
    if vehicle.battery_stage:
        return "Arm: Battery failsafe" if vehicle.flavour.name == "ardupilot" else "Arming denied: low battery"
    broken = _broken(vehicle)
    if broken is not None:
        return broken
    early = vehicle.now_s - vehicle.boot_s < 0.56 * (
        vehicle.ready_at_s - vehicle.boot_s
    )  # ArduCopter: in STABILIZE 23 s of 41 s suffice (measured)
    if early or (vehicle.mode.needs_position and not vehicle.ready):
        return vehicle.flavour.arm_refusal_text
    if vehicle.mode.behaviour in {Behaviour.RTL, Behaviour.LAND}:
        return f"Arm: {vehicle.mode.name} mode not armable"
    return None


def _arm(vehicle: Vehicle, *, forced: bool) -> Verdict:
    if vehicle.armed:
        return DONE
    why = None if forced else arming_refusal(vehicle)
    if why is not None:
        return Verdict(vehicle.flavour.arm_refusal, why)
    vehicle.arm()
    return Verdict(
        Result.ACCEPTED,
        "Arming motors" if vehicle.flavour.name == "ardupilot" else "Armed by external command",
    )


def _takeoff_down_m(vehicle: Vehicle, order: Order) -> float | None:
    """The height asked for, as NED from the pad; None when it is none."""
    height = order[7]
    if vehicle.flavour.takeoff_is_amsl:
        if not abs(height) <= 1e5:  # NaN too
            return vehicle.body.down_m - vehicle.params["MIS_TAKEOFF_ALT"]
        return vehicle.body.pad.alt_amsl_m - height
    return vehicle.home_ned_m[2] - height if 0 < height <= 1e5 else None


def _takeoff(vehicle: Vehicle, order: Order) -> Verdict:
    flavour = vehicle.flavour
    down_m = _takeoff_down_m(vehicle, order)
    north, east, here_m = vehicle.body.pos_ned_m
    if flavour.takeoff_switches_mode:
        if not vehicle.ready or vehicle.pilot_holds:
            return Verdict(flavour.mode_refusal, "Takeoff denied! Please disarm and retry")
        # PX4 climbs at least MIS_TAKEOFF_ALT when the height asked for is below (navigator, takeoff.cpp).
        lowest_m = here_m - vehicle.params["MIS_TAKEOFF_ALT"]
        vehicle.enter_behaviour(Behaviour.TAKEOFF)
        down_m = min(down_m, lowest_m) if down_m is not None and down_m < here_m + 1e-6 else lowest_m
    elif vehicle.mode.behaviour is not Behaviour.GUIDED or not vehicle.armed or vehicle.flying or down_m is None:
        return Verdict(Result.FAILED)
    vehicle.target = TakeoffTarget((north, east, down_m), vehicle.now_s + flavour.takeoff_delay_s)
    return DONE


def request_mode(vehicle: Vehicle, mode: Mode | None) -> Verdict:
    """A mode change from the ground."""
    flavour = vehicle.flavour
    if mode is None or vehicle.pilot_holds:
        return Verdict(flavour.mode_refusal, "" if mode is None else "Mode change denied: pilot has control")
    if vehicle.armed and mode.needs_position and not vehicle.ready:
        return Verdict(flavour.mode_refusal, f"Mode change to {mode.name} failed: requires position")
    needs_stream = flavour.guided_needs_stream and mode.behaviour is Behaviour.GUIDED
    if needs_stream and not setpoints.stream_established(vehicle):
        return Verdict(flavour.mode_refusal, "Switching to mode 'Offboard' is currently not")
    if mode.behaviour is Behaviour.MISSION and not missions.stored(vehicle):
        return Verdict(flavour.mode_refusal, f"Mode change to {mode.name} failed: no mission")
    if mode is not vehicle.mode:
        vehicle.enter(mode)
    return DONE


def _set_mode(vehicle: Vehicle, order: Order) -> Verdict:
    """param1 base mode, param2 custom mode; PX4 takes main and sub mode apart."""
    if not (isfinite(order[1]) and isfinite(order[2]) and isfinite(order[3])):
        return Verdict(Result.DENIED)
    if not int(order[1]) & 1:
        return Verdict(vehicle.flavour.mode_refusal)
    number = int(order[2])
    if vehicle.flavour.name == "px4":
        number = (number & 0xFF) << 16 | (int(order[3]) & 0xFF) << 24
    return request_mode(vehicle, vehicle.flavour.modes.by_number(number))


def _go_to_mode(behaviour: Behaviour) -> Handler:
    def handler(vehicle: Vehicle, _: Order) -> Verdict:
        return request_mode(vehicle, vehicle.flavour.modes.doing(behaviour))

    return handler


def _reposition(vehicle: Vehicle, order: Order) -> Verdict:
    """DO_REPOSITION: fly there and stay. ArduCopter accepts it disarmed too (measured)."""
    alt_m, here = order[7], vehicle.body.place
    if isfinite(alt_m):
        up_m = alt_m + (
            vehicle.home.alt_amsl_m if order.frame in _RELATIVE and not vehicle.flavour.takeoff_is_amsl else 0.0
        )
    else:
        up_m = here.alt_amsl_m
    place = Geodetic(order[5], order[6], up_m)
    if not plausible(place):
        return Verdict(Result.DENIED)
    behaviour = Behaviour.HOLD if vehicle.flavour.takeoff_switches_mode else Behaviour.GUIDED
    if vehicle.mode.behaviour is not behaviour:
        verdict = request_mode(vehicle, vehicle.flavour.modes.doing(behaviour))
        if verdict.result is not Result.ACCEPTED:
            return verdict
    if vehicle.flying:
        speed = order[1] if isfinite(order[1]) and order[1] > 0 else None
        vehicle.target = PositionTarget(to_ned_m(vehicle.body.pad, place), None, speed)
    return DONE


def _change_speed(vehicle: Vehicle, order: Order) -> Verdict:
    """Sets the speed of position flights; velocity setpoints keep theirs (measured on ArduCopter)."""
    if not isfinite(order[2]) or order[2] <= 0:
        return Verdict(Result.DENIED)
    name, scale = ("MPC_XY_CRUISE", 1.0) if vehicle.flavour.name == "px4" else ("WPNAV_SPEED", 100.0)
    vehicle.params.set(name, order[2] * scale)
    return DONE


def _condition_yaw(vehicle: Vehicle, order: Order) -> Verdict:
    """Turns the nose while hovering in guided flight."""
    if not isfinite(order[1]):
        return Verdict(Result.DENIED)
    yaw_rad = radians(order[1]) + (vehicle.body.yaw_rad if order[4] == 1.0 else 0.0)
    if vehicle.mode.behaviour is not Behaviour.GUIDED or not vehicle.flying:
        return Verdict(Result.FAILED)
    here = vehicle.target.pos_ned_m if isinstance(vehicle.target, PositionTarget) else vehicle.body.pos_ned_m
    vehicle.target = PositionTarget(here, yaw_rad)
    return DONE


def _set_home(vehicle: Vehicle, order: Order) -> Verdict:
    if order[1] == 1.0:
        vehicle.home_ned_m = vehicle.body.pos_ned_m
        return DONE
    place = Geodetic(order[5], order[6], order[7])
    if not plausible(place):
        return Verdict(Result.FAILED)
    vehicle.home_ned_m = to_ned_m(vehicle.body.pad, place)
    return DONE


def _terminate(vehicle: Vehicle, order: Order) -> Verdict:
    if order[1] > 0.5:
        vehicle.disarm("Flight termination")
    return DONE


def _mission_start(vehicle: Vehicle, _: Order) -> Verdict:
    verdict = request_mode(vehicle, vehicle.flavour.modes.doing(Behaviour.MISSION))
    if verdict.result is Result.ACCEPTED:
        vehicle.mission_item = 0
    return verdict


def _pause(vehicle: Vehicle, order: Order) -> Verdict:
    behaviour = Behaviour.HOLD if order[1] == 0.0 else Behaviour.MISSION
    return request_mode(vehicle, vehicle.flavour.modes.doing(behaviour))


def _prearm(vehicle: Vehicle, _: Order) -> Verdict:
    why = arming_refusal(vehicle)
    if why is not None:
        vehicle.say(Severity.CRITICAL, why.replace("Arm:", "PreArm:"))
    return DONE


def _reboot(vehicle: Vehicle, order: Order) -> Verdict:
    """PREFLIGHT_REBOOT_SHUTDOWN: param1 1 restarts the autopilot; refused while armed."""
    if order[1] != 1.0:
        return Verdict(Result.UNSUPPORTED if vehicle.flavour.name == "ardupilot" else Result.DENIED)
    if vehicle.armed:
        return Verdict(Result.FAILED if vehicle.flavour.name == "ardupilot" else Result.DENIED)
    vehicle.reboot_due_s = vehicle.now_s + _REBOOT_DELAY_S
    return DONE


def _calibrate(vehicle: Vehicle, order: Order) -> Verdict:
    """PREFLIGHT_CALIBRATION of the gyros (param1): ArduCopter reports IN_PROGRESS and the end of it."""
    if vehicle.armed:
        return Verdict(Result.FAILED if vehicle.flavour.name == "ardupilot" else Result.TEMPORARILY_REJECTED)
    if order[1] != 1.0:
        return Verdict(Result.UNSUPPORTED)
    if vehicle.flavour.name == "px4":
        return Verdict(Result.ACCEPTED, "[cal] calibration started: 2 gyro")
    return Verdict(Result.IN_PROGRESS, "Calibrating gyros", then_s=_GYRO_S)


def _fence_enable(vehicle: Vehicle, order: Order) -> Verdict:
    """DO_FENCE_ENABLE: ArduCopter only (AC_Fence)."""
    if vehicle.flavour.name != "ardupilot":
        return Verdict(Result.UNSUPPORTED)
    if order[1] not in (0.0, 1.0):
        return Verdict(Result.FAILED)
    vehicle.params.set("FENCE_ENABLE", order[1])
    return DONE


def _battery_reset(vehicle: Vehicle, _: Order) -> Verdict:
    vehicle.battery_stage, vehicle.battery_low_s = 0, None
    return DONE


HANDLERS: dict[int, Handler] = {
    Command.COMPONENT_ARM_DISARM: _arm_disarm,
    Command.NAV_TAKEOFF: _takeoff,
    Command.DO_SET_MODE: _set_mode,
    Command.NAV_RETURN_TO_LAUNCH: _go_to_mode(Behaviour.RTL),
    Command.NAV_LAND: _go_to_mode(Behaviour.LAND),
    Command.NAV_LOITER_UNLIM: _go_to_mode(Behaviour.HOLD),
    Command.DO_REPOSITION: _reposition,
    Command.DO_CHANGE_SPEED: _change_speed,
    Command.CONDITION_YAW: _condition_yaw,
    Command.DO_SET_HOME: _set_home,
    Command.DO_FLIGHTTERMINATION: _terminate,
    Command.DO_PAUSE_CONTINUE: _pause,
    Command.MISSION_START: _mission_start,
    Command.RUN_PREARM_CHECKS: _prearm,
    Command.BATTERY_RESET: _battery_reset,
    Command.PREFLIGHT_REBOOT_SHUTDOWN: _reboot,
    Command.PREFLIGHT_CALIBRATION: _calibrate,
    Command.DO_FENCE_ENABLE: _fence_enable,
}
