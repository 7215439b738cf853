"""Where a UAV may be: inside the area, clear of obstacles that reach its altitude, able to stop in time."""

from policy.world.arrays import Array, array_namespace
from policy.world.geometry import distance_to_polygon_m, inside_rectangle
from policy.world.motion import SAMPLES_PER_SLOT, slot_path_m, slot_times_s, stopping_point_m
from policy.world.scenario import Scenario

EDGE_TOLERANCE_M = 1e-6  # rounding of a path that ends exactly on the edge


def hits_obstacle(points_m: Array, scenario: Scenario, margin_m: float = 0.0) -> Array:
    """Within ``margin_m`` of an obstacle as high as the UAVs fly: [..., 2] -> bool [...]."""
    xp = array_namespace(points_m)
    hit = xp.zeros_like(points_m[..., 0]) > 0.0
    for obstacle in scenario.blocking_obstacles:
        hit = hit | (distance_to_polygon_m(points_m, obstacle.polygon_m) <= margin_m)
    return hit


def inside_area(points_m: Array, scenario: Scenario, margin_m: float = 0.0) -> Array:
    """[..., 2] -> bool [...]."""
    return inside_rectangle(points_m, scenario.area.size_m, margin_m - EDGE_TOLERANCE_M)


def legal_moves(
    pos_m: Array, vel_mps: Array, vel_command_mps: Array, scenario: Scenario, vel_end_mps: Array | None = None
) -> Array:
    """Moves that stay inside and clear of obstacles through the slot, and leave room to brake after it.

    Positions [..., 2], velocities [..., 2] (broadcast against each other) -> bool [...]. A UAV that only
    makes legal moves always has one: braking, or for the paper's motion hovering. ``vel_end_mps`` [..., 2]: at which
    the slot is left (None: as commanded).
    """
    xp = array_namespace(pos_m, vel_mps, vel_command_mps)
    pos_m, vel_mps, vel_command_mps = xp.broadcast_arrays(pos_m, vel_mps, vel_command_mps)
    accel = scenario.max_accel_mps2
    path_m, speeds_mps = slot_path_m(pos_m, vel_mps, vel_command_mps, accel, scenario.slot_s, vel_end_mps)
    end_speed_mps = speeds_mps[..., -1]
    leaving_mps = vel_command_mps if vel_end_mps is None else vel_end_mps
    braking_m = _braking_path_m(path_m[..., -1, :], leaving_mps, end_speed_mps, scenario)
    points_m = xp.concat((path_m, braking_m), axis=-2)
    clear = inside_area(points_m, scenario) & ~hits_obstacle(points_m, scenario, scenario.obstacle_margin_m)
    return xp.all(clear, axis=-1)


def _braking_path_m(pos_m: Array, vel_mps: Array, speed_mps: Array, scenario: Scenario) -> Array:
    """Points from ``pos_m`` to where braking ends: [..., 2] -> [..., K, 2]."""
    xp = array_namespace(pos_m)
    stop_m = stopping_point_m(pos_m, vel_mps, scenario.max_accel_mps2)
    shares = slot_times_s(speed_mps, 1.0, 1 + SAMPLES_PER_SLOT // 6)
    return pos_m[..., None, :] + shares[:, None] * xp.expand_dims(stop_m - pos_m, axis=-2)
