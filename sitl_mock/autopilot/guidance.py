"""Where each mode steers: the velocity that a vehicle follows this tick."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, sqrt
from typing import TYPE_CHECKING

from sitl_mock.autopilot import mission_flight
from sitl_mock.autopilot.constants import Severity
from sitl_mock.autopilot.modes import Behaviour
from sitl_mock.autopilot.state import PositionTarget, TakeoffTarget, Vehicle, VelocityTarget

if TYPE_CHECKING:
    from collections.abc import Callable

    from sitl_mock.body import Vec3

_STILL = (0.0, 0.0, 0.0)
_POSITION_GAIN_1PS = 0.8
_BRAKE_SHARE = 0.5  # of the acceleration limit, so that jerk and lag do not make it overshoot
_REACHED_M = 0.4


@dataclass(frozen=True, slots=True)
class Drive:
    """What the body is told."""

    vel_ned_mps: Vec3
    yaw_rad: float | None = None


def closing_speed(distance_m: float, top_mps: float, accel_mps2: float) -> float:
    """Speed that still stops at the goal: proportional near it, then a square root, then `top_mps`."""
    brake, top_mps = _BRAKE_SHARE * accel_mps2, max(top_mps, 0.0)
    linear_m = brake / _POSITION_GAIN_1PS**2
    if distance_m <= linear_m:
        return min(top_mps, _POSITION_GAIN_1PS * distance_m)
    return min(top_mps, sqrt(2.0 * brake * (distance_m - 0.5 * linear_m)))


def towards(vehicle: Vehicle, goal_ned_m: Vec3, speed_mps: float, up_mps: float, down_mps: float) -> Vec3:
    """Velocity that brings the vehicle to a place and holds it there."""
    kind = vehicle.body.kind
    north, east, down = (goal - here for goal, here in zip(goal_ned_m, vehicle.body.pos_ned_m, strict=True))
    distance = hypot(north, east)
    scale = closing_speed(distance, speed_mps, kind.max_accel_mps2) / distance if distance > 1e-6 else 0.0
    climb = closing_speed(abs(down), up_mps if down < 0 else down_mps, kind.max_accel_z_mps2)
    return north * scale, east * scale, climb if down > 0 else -climb


def _hold(vehicle: Vehicle) -> Drive:
    """Stops, then keeps the place where it stopped."""
    if not vehicle.flying:
        return Drive(_STILL)
    if not isinstance(vehicle.target, PositionTarget):
        if max(map(abs, vehicle.body.vel_ned_mps)) > 0.3:
            return Drive(_STILL)
        vehicle.target = PositionTarget(vehicle.body.pos_ned_m)
    return _go(vehicle, vehicle.target)


def _go(vehicle: Vehicle, target: PositionTarget) -> Drive:
    kind = vehicle.body.kind
    speed = vehicle.flavour.return_plan(vehicle.params).speed_mps if target.speed_mps is None else target.speed_mps
    return Drive(towards(vehicle, target.pos_ned_m, speed, kind.climb_mps, kind.descent_mps), target.yaw_rad)


def _takeoff(vehicle: Vehicle, target: TakeoffTarget) -> Drive:
    """Waits for the motors, climbs, then holds the height (PX4 changes to its hold mode)."""
    if vehicle.now_s < target.lift_off_s:
        return Drive(_STILL)
    if abs(target.pos_ned_m[2] - vehicle.body.down_m) < _REACHED_M:
        if vehicle.flavour.takeoff_switches_mode:
            vehicle.enter_behaviour(Behaviour.HOLD)
        vehicle.target = PositionTarget(target.pos_ned_m)
    kind = vehicle.body.kind
    return Drive(towards(vehicle, target.pos_ned_m, 2.0, kind.climb_mps, kind.descent_mps))


def _take_off(vehicle: Vehicle) -> Drive:
    """PX4's takeoff mode; armed later, it lifts off then."""
    target = vehicle.target
    if not isinstance(target, TakeoffTarget):
        return _hold(vehicle)
    if (
        vehicle.armed
        and not vehicle.flying
        and vehicle.armed_at_s + vehicle.flavour.takeoff_delay_s > target.lift_off_s
    ):
        target = TakeoffTarget(target.pos_ned_m, vehicle.armed_at_s + vehicle.flavour.takeoff_delay_s)
        vehicle.target = target
    return _takeoff(vehicle, target)


def _guided(vehicle: Vehicle) -> Drive:
    """Follows the newest target; velocities grow stale (GUID_TIMEOUT, COM_OF_LOSS_T)."""
    target = vehicle.target
    if isinstance(target, TakeoffTarget):
        return _takeoff(vehicle, target)
    if setpoints_lost(vehicle):
        after = vehicle.flavour.setpoint_loss_mode(vehicle.params)
        mode = vehicle.flavour.modes.by_name(after) if after else None
        if mode is not None:
            vehicle.say(Severity.CRITICAL, "Failsafe: offboard setpoints lost")
            vehicle.enter(mode)
            return _hold(vehicle)
        if isinstance(target, VelocityTarget):
            return Drive(_STILL, target.yaw_rad)
    if isinstance(target, VelocityTarget):
        return Drive(target.vel_ned_mps if vehicle.flying or target.vel_ned_mps[2] < 0 else _STILL, target.yaw_rad)
    return _hold(vehicle)


def setpoints_lost(vehicle: Vehicle) -> bool:
    """Whether the newest setpoint is older than the flavour allows."""
    return vehicle.now_s - vehicle.setpoint_s >= vehicle.flavour.setpoint_timeout_s(vehicle.params) - 1e-9


def _step(vehicle: Vehicle, stage: str) -> None:
    vehicle.stage, vehicle.stage_s = stage, vehicle.now_s


def _return(vehicle: Vehicle) -> Drive:
    """Climb, way back, pause, landing (stages by name)."""
    if not vehicle.flying and vehicle.stage in {"", "climb"}:
        return _land(vehicle)
    plan = vehicle.flavour.return_plan(vehicle.params)
    kind, here, home = vehicle.body.kind, vehicle.body.pos_ned_m, vehicle.home_ned_m
    top_down_m = min(here[2], home[2] - plan.climb_to_m)
    if vehicle.stage in {"descend", "touchdown"}:
        return _land(vehicle)
    if vehicle.stage in {"", "climb"}:
        if not vehicle.stage:
            vehicle.target = PositionTarget((here[0], here[1], top_down_m))
            _step(vehicle, "climb")
        assert isinstance(vehicle.target, PositionTarget)
        if abs(vehicle.target.pos_ned_m[2] - here[2]) < _REACHED_M:
            vehicle.target = PositionTarget((home[0], home[1], here[2]))
            _step(vehicle, "way back")
    elif vehicle.stage == "way back" and hypot(here[0] - home[0], here[1] - home[1]) < _REACHED_M:
        _step(vehicle, "pause")
    elif vehicle.stage == "pause" and vehicle.now_s - vehicle.stage_s >= plan.pause_s:
        _step(vehicle, "descend")
    assert isinstance(vehicle.target, PositionTarget)
    goal = vehicle.target.pos_ned_m
    return Drive(towards(vehicle, goal, plan.speed_mps, kind.climb_mps, kind.descent_mps))


def _land(vehicle: Vehicle) -> Drive:
    """Straight down: fast, then slow near the ground, until the ground carries it."""
    plan = vehicle.flavour.return_plan(vehicle.params)
    if vehicle.stage not in {"descend", "touchdown"}:
        vehicle.target = None
        _step(vehicle, "descend")
    if not isinstance(vehicle.target, PositionTarget) and max(map(abs, vehicle.body.vel_ned_mps[:2])) < 0.3:
        vehicle.target = PositionTarget(vehicle.body.pos_ned_m)
    if vehicle.stage == "descend" and vehicle.alt_home_m <= plan.descend_to_m:
        _step(vehicle, "touchdown")
    down = plan.touchdown_mps if vehicle.stage == "touchdown" else plan.descent_mps
    if not isinstance(vehicle.target, PositionTarget):
        return Drive((0.0, 0.0, down))
    north, east, _ = towards(vehicle, vehicle.target.pos_ned_m, plan.speed_mps, 1.0, 1.0)
    return Drive((north, east, down))


def _mission(vehicle: Vehicle) -> Drive:
    """Flies the stored items one after the other, then holds."""
    step = mission_flight.current_step(vehicle)
    if step is mission_flight.Step.RETURN:
        return _return(vehicle)
    if step is mission_flight.Step.LAND:
        return _land(vehicle)
    return _takeoff(vehicle, vehicle.target) if isinstance(vehicle.target, TakeoffTarget) else _hold(vehicle)


RUN: dict[Behaviour, Callable[[Vehicle], Drive]] = {
    Behaviour.PILOT: _hold,
    Behaviour.HOLD: _hold,
    Behaviour.TAKEOFF: _take_off,
    Behaviour.GUIDED: _guided,
    Behaviour.MISSION: _mission,
    Behaviour.RTL: _return,
    Behaviour.LAND: _land,
}
