"""The gate's rules, each a pure function of setpoint, track and envelope.

Simple limits act on numbers alone. The places that a setpoint may lead to are judged by :func:`hazards`: a
velocity is safe when, after it has been obeyed for one tick, full braking still ends clear of every bound. A fleet
that only takes safe velocities always has a safe one left: braking.
"""

import math
from dataclasses import dataclass

import numpy as np

from gcs.ports import UavTrack, VelocitySetpoint
from gcs.safety.envelope import Envelope
from policy.world.arrays import BoolArray, FloatArray, norm
from policy.world.geometry import distance_to_polygon_m
from policy.world.motion import displacement_m, velocity_mps

BRAKE_SAMPLES = 16
"""Points of a braking path that obstacles and other UAVs are checked at."""

Enu = tuple[float, float, float]
"""Velocity east, north, up."""


@dataclass(frozen=True)
class Forecast:
    """Where C candidate velocities lead: places [C, K, 2] while braking after one tick, climb [C]."""

    path_m: FloatArray
    climb_mps: FloatArray
    times_s: FloatArray  # [K] after the tick

    def only(self, choice: int) -> "Forecast":
        """The forecast of one candidate, C = 1."""
        return Forecast(self.path_m[choice : choice + 1], self.climb_mps[choice : choice + 1], self.times_s)


def is_finite(setpoint: VelocitySetpoint) -> bool:
    """All four numbers are numbers."""
    return all(math.isfinite(value) for value in (*setpoint.vel_ned_mps, setpoint.yaw_rad))


def limit_speed(vel: Enu, envelope: Envelope) -> Enu:
    """Level speed and climb within the envelope; the direction stays."""
    east, north, up = vel
    speed = math.hypot(east, north)
    share = envelope.max_speed_mps / speed if speed > envelope.max_speed_mps else 1.0
    return east * share, north * share, min(envelope.max_climb_mps, max(-envelope.max_descent_mps, up))


def limit_altitude(vel: Enu, alt_home_m: float, envelope: Envelope) -> Enu:
    """Climb or descent that can still stop within the altitude band; outside it only the way back."""
    east, north, up = vel
    highest = _approach_mps(envelope.max_alt_home_m - alt_home_m, envelope)
    lowest = -_approach_mps(alt_home_m - envelope.min_alt_home_m, envelope)
    return east, north, min(max(up, lowest), highest)


def is_far_from_bounds(track: UavTrack, envelope: Envelope) -> bool:
    """Nothing within reach whatever is commanded: the cheap answer for most ticks."""
    top_mps = max(track.speed_mps, envelope.max_speed_mps)
    reach_m = top_mps * (envelope.reaction_s + envelope.tick_s) + top_mps * top_mps / (2.0 * envelope.brake_mps2)
    room_m = reach_m + envelope.fence_margin_m
    east_m, north_m = track.east_m, track.north_m
    width_m, height_m = envelope.size_m
    if min(east_m, north_m, width_m - east_m, height_m - north_m) < room_m:
        return False
    keep_m = reach_m + envelope.obstacle_margin_m
    return all(_box_distance_m(east_m, north_m, polygon) > keep_m for polygon in envelope.obstacles)


def forecast(track: UavTrack, last_enu: Enu, candidates: FloatArray, envelope: Envelope, dead_s: float) -> Forecast:
    """``dead_s`` under the last velocity, one tick under each candidate [C, 3], then full braking."""
    place, speed = np.array([track.east_m, track.north_m]), np.array([track.vel_east_mps, track.vel_north_mps])
    last = np.asarray(last_enu[:2])
    times_s, tick_s = brake_times_s(envelope), np.asarray(envelope.tick_s)
    place = place + displacement_m(speed, last, envelope.accel_mps2, np.asarray(dead_s))
    speed = velocity_mps(speed, last, envelope.accel_mps2, np.asarray(dead_s))
    places = place + displacement_m(speed, candidates[:, :2], envelope.accel_mps2, tick_s)
    speeds = velocity_mps(speed, candidates[:, :2], envelope.accel_mps2, tick_s)
    rest = np.zeros_like(speeds)[:, None, :]
    way_m = displacement_m(speeds[:, None, :], rest, envelope.brake_mps2, times_s)
    return Forecast(places[:, None, :] + way_m, candidates[:, 2], times_s)


def brake_times_s(envelope: Envelope) -> FloatArray:
    """[K] times over which every UAV comes to rest; one grid for all, so that paths compare at the same moment."""
    top_mps = envelope.max_speed_mps + envelope.accel_mps2 * (envelope.reaction_s + envelope.tick_s)
    return np.linspace(0.0, top_mps / envelope.brake_mps2, BRAKE_SAMPLES)


def fence_hazard_m(path_m: FloatArray, envelope: Envelope) -> FloatArray:
    """How far each point lies beyond the fence less its margin: [C, K, 2] -> [C, K], negative inside."""
    low = envelope.fence_margin_m - path_m
    high = path_m - (np.asarray(envelope.size_m) - envelope.fence_margin_m)
    return np.asarray(np.max(np.maximum(low, high), axis=-1), dtype=np.float64)


def obstacle_hazard_m(path_m: FloatArray, envelope: Envelope) -> FloatArray:
    """How deep each point lies in an obstacle's margin: [C, K, 2] -> [C, K], negative when clear."""
    worst = np.full(path_m.shape[:-1], -np.inf)
    for polygon in envelope.obstacles:
        worst = np.maximum(worst, envelope.obstacle_margin_m - distance_to_polygon_m(path_m, polygon))
    return worst


def separation_hazard_m(
    own: Forecast, own_alt_m: float, other: Forecast, other_alt_m: float, envelope: Envelope
) -> FloatArray:
    """How much nearer than the separation two UAVs come, both braking: [C, K]; ``other`` has one candidate.

    Heights count: a pair whose heights stay apart has no hazard.
    """
    apart_m = own_alt_m - other_alt_m
    later_m = apart_m + _levelled_off_m(own.climb_mps, envelope) - _levelled_off_m(other.climb_mps, envelope)[0]  # [C]
    nearest_m = np.where(apart_m * later_m <= 0.0, 0.0, np.minimum(abs(apart_m), np.abs(later_m)))
    level: BoolArray = nearest_m < envelope.vertical_separation_m
    gap_m = norm(own.path_m - other.path_m)
    return np.where(level[:, None], envelope.separation_m - gap_m, -np.inf)


def _levelled_off_m(climb_mps: FloatArray, envelope: Envelope) -> FloatArray:
    """Height gained until a climb or descent has been stopped: [C] -> [C]."""
    dead_s = envelope.reaction_s + envelope.tick_s
    return climb_mps * dead_s + climb_mps * np.abs(climb_mps) / (2.0 * envelope.vertical_accel_mps2)


def _approach_mps(room_m: float, envelope: Envelope) -> float:
    """Vertical speed toward a bound ``room_m`` away that can still stop; negative: away from it."""
    if room_m <= 0.0:
        return max(-1.0, room_m)
    reaction = envelope.vertical_accel_mps2 * envelope.reaction_s
    return math.sqrt(reaction * reaction + 2.0 * envelope.vertical_accel_mps2 * room_m) - reaction


def _box_distance_m(east_m: float, north_m: float, polygon: tuple[tuple[float, float], ...]) -> float:
    """Distance to the polygon's bounding box: never more than to the polygon itself."""
    easts, norths = [p[0] for p in polygon], [p[1] for p in polygon]
    d_east = max(min(easts) - east_m, 0.0, east_m - max(easts))
    d_north = max(min(norths) - north_m, 0.0, north_m - max(norths))
    return math.hypot(d_east, d_north)
