"""Velocity commands that close the loop on a reference, a point or an altitude. Pure; one tick a call."""

import math
from dataclasses import dataclass

from gcs.guidance.reference import SlotReference
from gcs.ports import UavTrack, VelocitySetpoint

YAW_MIN_SPEED_MPS = 1.0  # below this the direction of travel is noise; the nose stays where it is


@dataclass(frozen=True)
class Gains:
    """Guidance constants; measured on the mock's M600 (docs/operations.md)."""

    position_per_s: float = 0.5  # position error to velocity
    lead_s: float = 0.5  # a multirotor's velocity follows a command about this late
    altitude_per_s: float = 0.8
    climb_mps: float = 2.0
    descent_mps: float = 2.0
    approach_accel_mps2: float = 1.5  # braking assumed when flying to a point to stay there


DEFAULT_GAINS = Gains()


def follow(
    track: UavTrack, reference: SlotReference, alt_home_m: float, now_s: float, *, max_speed_mps: float, gains: Gains
) -> VelocitySetpoint:
    """The velocity that brings the UAV onto its reference: feed-forward ahead of the vehicle's lag, plus the error.

    The reference's end carries its own velocity, so the slot is left at speed and the next one starts from it.
    """
    here, ahead = reference.at(now_s), reference.at(now_s + gains.lead_s)
    east_mps = ahead.vel_east_mps + gains.position_per_s * (here.east_m - track.east_m)
    north_mps = ahead.vel_north_mps + gains.position_per_s * (here.north_m - track.north_m)
    return _setpoint(track, *_limited(east_mps, north_mps, max_speed_mps), alt_home_m, gains)


def approach(
    track: UavTrack,
    point_m: tuple[float, float],
    alt_home_m: float,
    max_speed_mps: float,
    gains: Gains,
) -> VelocitySetpoint:
    """The velocity toward a point and, arrived, the one that stays there."""
    east_m, north_m = point_m[0] - track.east_m, point_m[1] - track.north_m
    distance_m = math.hypot(east_m, north_m)
    if distance_m == 0.0:
        return _setpoint(track, 0.0, 0.0, alt_home_m, gains)
    braking_mps = math.sqrt(2.0 * gains.approach_accel_mps2 * distance_m)
    speed_mps = min(max_speed_mps, braking_mps, gains.position_per_s * distance_m)
    share = speed_mps / distance_m
    return _setpoint(track, east_m * share, north_m * share, alt_home_m, gains)


def keep_velocity(
    track: UavTrack, vel_enu_mps: tuple[float, float], alt_home_m: float, max_speed_mps: float, gains: Gains
) -> VelocitySetpoint:
    """Go on as before, while a decision is awaited."""
    return _setpoint(track, *_limited(*vel_enu_mps, max_speed_mps), alt_home_m, gains)


def holding_point_m(track: UavTrack, max_accel_mps2: float) -> tuple[float, float]:
    """Where the UAV can come to rest: the point to hold when it has to stop now."""
    way_s = track.speed_mps / (2.0 * max_accel_mps2)
    return (track.east_m + track.vel_east_mps * way_s, track.north_m + track.vel_north_mps * way_s)


def _setpoint(track: UavTrack, east_mps: float, north_mps: float, alt_home_m: float, gains: Gains) -> VelocitySetpoint:
    climb_mps = gains.altitude_per_s * (alt_home_m - track.alt_home_m)
    climb_mps = min(gains.climb_mps, max(-gains.descent_mps, climb_mps))
    # ArduPilot#22840: a velocity with yaw ignored resets the yaw, so it is always commanded.
    moving = math.hypot(east_mps, north_mps) >= YAW_MIN_SPEED_MPS
    yaw_rad = math.atan2(east_mps, north_mps) if moving else track.yaw_rad
    return VelocitySetpoint(track.system_id, (north_mps, east_mps, -climb_mps), yaw_rad)


def _limited(east_mps: float, north_mps: float, limit_mps: float) -> tuple[float, float]:
    speed_mps = math.hypot(east_mps, north_mps)
    if speed_mps <= limit_mps:
        return east_mps, north_mps
    return east_mps * limit_mps / speed_mps, north_mps * limit_mps / speed_mps
