"""Failsafes: battery, ground-station link, position estimate. Each acts once."""

from __future__ import annotations

from sitl_mock.autopilot import fence
from sitl_mock.autopilot.constants import Severity
from sitl_mock.autopilot.modes import Behaviour
from sitl_mock.autopilot.state import TakeoffTarget, Vehicle

_LANDING = {Behaviour.RTL, Behaviour.LAND}


def _switch(vehicle: Vehicle, name: str | None) -> None:
    """Enters a failsafe's mode; a landing vehicle is not disturbed by a return."""
    mode = vehicle.flavour.modes.by_name(name) if name else None
    if mode is None or not (vehicle.armed and vehicle.flying) or vehicle.mode is mode:
        return
    if vehicle.mode.behaviour is not Behaviour.LAND:
        vehicle.enter(mode)


def battery(vehicle: Vehicle) -> None:
    """Low for long enough, then critical; latched until BATTERY_RESET. Empty stops the motors."""
    rule, state = vehicle.flavour.battery_rule(vehicle.params), vehicle.body.battery
    if state.remaining <= 0.0 and vehicle.armed:
        vehicle.disarm("Battery empty: motors stopped")
        return
    low = state.voltage_v < rule.low_v or state.remaining < rule.low_fraction
    vehicle.battery_low_s = (
        (vehicle.battery_low_s if vehicle.battery_low_s is not None else vehicle.now_s) if low else None
    )
    long_enough = vehicle.battery_low_s is not None and vehicle.now_s - vehicle.battery_low_s >= rule.low_delay_s
    if vehicle.battery_stage == 0 and long_enough:
        vehicle.battery_stage = 1
        _warn_battery(vehicle, "low", state.voltage_v, state.used_mah)
        _switch(vehicle, rule.low_mode)
    if vehicle.battery_stage == 1 and state.remaining < rule.critical_fraction:
        vehicle.battery_stage = 2
        _warn_battery(vehicle, "critical", state.voltage_v, state.used_mah)
        _switch(vehicle, rule.critical_mode)


def _warn_battery(vehicle: Vehicle, level: str, voltage_v: float, used_mah: float) -> None:
    if vehicle.flavour.name == "px4":
        vehicle.say(Severity.WARNING, f"{level.capitalize()} battery level! Return advised")
        return
    vehicle.say(Severity.WARNING, f"Battery 1 is {level} {voltage_v:.2f}V used {used_mah:.0f} mAh")
    vehicle.say(Severity.WARNING, "Battery Failsafe")


def ground_link(vehicle: Vehicle) -> None:
    """The ground station's heartbeats stopped. Armed only once one was heard, as the real ones are."""
    rule = vehicle.flavour.link_rule(vehicle.params)
    if not rule.enabled or vehicle.link_heard_s is None:
        return
    lost = vehicle.now_s - vehicle.link_heard_s > rule.timeout_s
    if lost and not vehicle.link_lost and vehicle.armed:
        vehicle.say(Severity.WARNING, rule.text)
        _switch(vehicle, rule.mode)
    vehicle.link_lost = lost


def heard_ground(vehicle: Vehicle, system: int) -> None:
    """Counts a ground station's heartbeat if its system id is the one that counts."""
    only = vehicle.flavour.link_rule(vehicle.params).only_system
    if only in (0, system):
        vehicle.link_heard_s = vehicle.now_s


def position(vehicle: Vehicle) -> None:
    """GPS gone: dead reckoning for a while, then down (a hover by attitude needs no position)."""
    if not vehicle.faults.gps_lost:
        vehicle.gps_lost_s = None
        return
    if vehicle.gps_lost_s is None:
        vehicle.gps_lost_s = vehicle.now_s
    due = vehicle.now_s - vehicle.gps_lost_s >= vehicle.flavour.gps_loss_s
    if due and vehicle.mode.needs_position and vehicle.flying and vehicle.mode.behaviour is not Behaviour.LAND:
        vehicle.say(Severity.CRITICAL, "EKF Failsafe: changed to LAND Mode")
        _switch(vehicle, vehicle.flavour.gps_loss_mode)


def ground_contact(vehicle: Vehicle) -> None:
    """Keeps track of lift-off and touch-down, and disarms after a landing or when idle."""
    if not vehicle.body.on_ground:
        vehicle.touched_down_s = None
        return
    if vehicle.touched_down_s is None:
        vehicle.touched_down_s = vehicle.now_s
        if vehicle.armed:
            vehicle.say(Severity.INFO, "Landing detected" if vehicle.flavour.name == "px4" else "SIM Hit ground")
    if not vehicle.armed:
        return
    since_s = vehicle.now_s - max(vehicle.touched_down_s, vehicle.armed_at_s)
    if vehicle.mode.behaviour in _LANDING or vehicle.stage in {"descend", "touchdown"}:
        if since_s >= vehicle.flavour.landed_disarm_s:
            vehicle.disarm("Disarmed by landing" if vehicle.flavour.name == "px4" else "Disarming motors")
        return
    idle_s = vehicle.flavour.idle_disarm_s(vehicle.params)
    if idle_s > 0 and since_s >= idle_s and not isinstance(vehicle.target, TakeoffTarget):
        vehicle.disarm("Disarmed by auto preflight disarming" if vehicle.flavour.name == "px4" else "Disarming motors")


def estimate(vehicle: Vehicle) -> None:
    """ArduCopter tells when its filter doubts the receiver (ekf_check.cpp gpsglitch_check)."""
    doubting = vehicle.body.position.doubting
    if doubting != vehicle.glitching and vehicle.flavour.name == "ardupilot":
        vehicle.say(Severity.CRITICAL, "GPS Glitch or Compass error" if doubting else "Glitch cleared")
    vehicle.glitching = doubting


def motors(vehicle: Vehicle) -> None:
    """A motor that gives no thrust is noticed in the air."""
    out = vehicle.body.motors_out
    if out > vehicle.motors_told and vehicle.armed and vehicle.flying:
        text = f"Potential Thrust Loss ({out})" if vehicle.flavour.name == "ardupilot" else "Motor failure detected"
        vehicle.say(Severity.EMERGENCY, text)
        vehicle.motors_told = out
    elif out == 0:
        vehicle.motors_told = 0


def check(vehicle: Vehicle) -> None:
    """All but the ground contact, which is looked at first."""
    estimate(vehicle)
    motors(vehicle)
    fence.check(vehicle)
    battery(vehicle)
    ground_link(vehicle)
    position(vehicle)
