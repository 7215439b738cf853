"""SET_POSITION_TARGET messages to targets, type masks and frames judged as the real ones do."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, isfinite, sin
from typing import TYPE_CHECKING

from sitl_mock.autopilot.constants import Frame, Ignore
from sitl_mock.autopilot.modes import Behaviour
from sitl_mock.autopilot.state import PositionTarget, TakeoffTarget, Vehicle, VelocityTarget
from sitl_mock.geodesy import Geodetic, plausible, to_ned_m

if TYPE_CHECKING:
    from sitl_mock.body import Vec3
    from sitl_mock.wire import Frame as Message

_GLOBAL_AMSL = {Frame.GLOBAL, Frame.GLOBAL_INT}
_GLOBAL_RELATIVE = {Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT}
_LOCAL = {Frame.LOCAL_NED, Frame.LOCAL_OFFSET_NED, Frame.BODY_NED, Frame.BODY_OFFSET_NED}
_BODY = {Frame.BODY_NED, Frame.BODY_OFFSET_NED}
_STREAM_GAP_S = 0.5  # PX4 wants more than 2 Hz (protocol: offboard mode)
_STREAM_MIN_S = 1.0
_FARTHEST_M = 1e5  # a local position farther off than this is a mistake


@dataclass(frozen=True, slots=True)
class Stop:
    """A setpoint that means nothing: the vehicle stops (ArduCopter re-enters GUIDED)."""


def _turned(vehicle: Vehicle, vec: Vec3, frame: int) -> Vec3:
    """Body axes to north and east."""
    if frame not in _BODY:
        return vec
    yaw = vehicle.body.yaw_rad
    return vec[0] * cos(yaw) - vec[1] * sin(yaw), vec[0] * sin(yaw) + vec[1] * cos(yaw), vec[2]


def _position_ned_m(vehicle: Vehicle, message: Message) -> Vec3 | None:
    """The place meant, NED from the pad; None when it is no place."""
    frame = message["coordinate_frame"]
    if message.name == "SET_POSITION_TARGET_LOCAL_NED":
        vec = _turned(vehicle, (message["x"], message["y"], message["z"]), frame)
        if not all(abs(part) <= _FARTHEST_M for part in vec):  # NaN too
            return None
        if frame == Frame.LOCAL_NED:
            return vec
        here = vehicle.body.pos_ned_m
        return here[0] + vec[0], here[1] + vec[1], here[2] + vec[2]
    up = message["alt"] + (vehicle.home.alt_amsl_m if frame in _GLOBAL_RELATIVE else 0.0)
    place = Geodetic(message["lat_int"] / 1e7, message["lon_int"] / 1e7, up)
    return to_ned_m(vehicle.body.pad, place) if plausible(place) else None


def _yaw_rad(vehicle: Vehicle, message: Message) -> float | None:
    if message["type_mask"] & Ignore.YAW or not isfinite(message["yaw"]):
        return None
    return float(message["yaw"]) + (vehicle.body.yaw_rad if message["coordinate_frame"] in _BODY else 0.0)


def decode(vehicle: Vehicle, message: Message) -> VelocityTarget | PositionTarget | Stop:
    """What the message asks for."""
    mask, frame = message["type_mask"], message["coordinate_frame"]
    known = _LOCAL if message.name == "SET_POSITION_TARGET_LOCAL_NED" else _GLOBAL_AMSL | _GLOBAL_RELATIVE
    if frame not in known:
        return Stop()
    yaw_rad = _yaw_rad(vehicle, message)
    vel = _turned(vehicle, (message["vx"], message["vy"], message["vz"]), frame)
    has_position, has_velocity = not mask & Ignore.POSITION, not mask & Ignore.VELOCITY
    if has_velocity and not all(map(isfinite, vel)):
        return Stop()
    if has_position:
        place = _position_ned_m(vehicle, message)
        if place is None:
            return Stop()
        speed = max(sum(part * part for part in vel) ** 0.5, 0.1) if has_velocity else None
        return PositionTarget(place, yaw_rad, speed)
    return VelocityTarget(vel, yaw_rad) if has_velocity else Stop()


def _note_arrival(vehicle: Vehicle) -> None:
    """Keeps track of how long setpoints have come without a gap."""
    if vehicle.now_s - vehicle.setpoint_s > _STREAM_GAP_S:
        vehicle.stream_since_s = vehicle.now_s
    vehicle.setpoint_s = vehicle.now_s


def stream_established(vehicle: Vehicle) -> bool:
    """Whether setpoints have come at more than 2 Hz for more than a second, up to now."""
    fresh = vehicle.now_s - vehicle.setpoint_s <= _STREAM_GAP_S
    return fresh and vehicle.now_s - vehicle.stream_since_s > _STREAM_MIN_S


def receive(vehicle: Vehicle, message: Message) -> None:
    """Takes a setpoint. It is never acknowledged, and ignored without a word where it does not count."""
    target = decode(vehicle, message)
    flavour = vehicle.flavour
    if flavour.guided_needs_stream and isinstance(target, Stop):
        return  # PX4 drops what it cannot read
    _note_arrival(vehicle)
    if vehicle.mode.behaviour is not Behaviour.GUIDED or not vehicle.armed:
        return
    if not flavour.guided_needs_stream and not vehicle.flying:
        return  # ArduCopter on the ground waits for a takeoff
    if isinstance(vehicle.target, TakeoffTarget) and not flavour.setpoint_cancels_takeoff:
        return
    vehicle.target = VelocityTarget((0.0, 0.0, 0.0)) if isinstance(target, Stop) else target
