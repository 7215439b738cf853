"""What one UAV sees of the crowd, whatever the crowd's size: freshness sampled around it, where it could soon be.

The points lie on rings of one, two, three ... slots' flight, the first ring where the eight headings of the paper's
actions end; far rings collect users from a wider circle, so that nobody within reach of a plan is overlooked.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

from policy.world.arrays import Array, FloatArray, array_namespace
from policy.world.channel import serving_radius_m
from policy.world.scenario import Scenario
from policy.world.state import WorldState

RINGS_SLOTS = (1.0, 2.0, 3.0, 4.5, 6.5, 9.5)
"""Distance of each ring, in slots of flight at full speed."""
CHANNELS = 4
"""At each point: AoI within reach, share of users within reach, other UAVs near, inside the area."""
OWN_FEATURES = 6
"""Of the UAV itself: where it is in the area (2), energy left, slot, serving radius by slot's way, mean AoI."""
SOFT_SHARE = 0.2
"""Of the radius: a user at the edge counts by half, so that the field has no steps."""
AOI_UNIT = 0.2
"""Scale of ages: five slots are one."""
NUM_POINTS = 9 + 16 * (len(RINGS_SLOTS) - 1)
NUM_FEATURES = NUM_POINTS * CHANNELS + OWN_FEATURES


@dataclass(frozen=True)
class Points:
    """Where the field is sampled, relative to the UAV: ``offset_m`` [P, 2], ``radius_m`` [P]."""

    offset_m: FloatArray
    radius_m: FloatArray


@cache
def sample_points(step_m: float, serving_radius_m: float) -> Points:
    """The UAV's own place, eight points of the first ring, sixteen of each other ring (P = 89)."""
    offsets, radii = [np.zeros((1, 2))], [np.array([serving_radius_m])]
    for number, ring in enumerate(RINGS_SLOTS):
        headings = 8 if number == 0 else 16
        angle = np.arange(headings) * (2.0 * math.pi / headings)
        offsets.append(ring * step_m * np.stack((np.sin(angle), np.cos(angle)), axis=-1))
        apart_m = 2.0 * math.pi * ring * step_m / headings
        radii.append(np.full(headings, serving_radius_m if number == 0 else max(serving_radius_m, 0.6 * apart_m)))
    return Points(np.concatenate(offsets), np.concatenate(radii))


def features(scenario: Scenario, state: WorldState) -> Array:
    """All that a UAV is told: state [..., U, ·] -> [..., U, NUM_FEATURES], in the library and type of the state."""
    xp = array_namespace(state.uav_pos_enu_m)
    field = freshness_field(scenario, state)
    flat = xp.reshape(field, (*field.shape[:-2], NUM_POINTS * CHANNELS))
    return xp.concat((flat, own_features(scenario, state)), axis=-1)


def freshness_field(scenario: Scenario, state: WorldState) -> Array:
    """The crowd around each UAV: [..., U, P, CHANNELS]."""
    xp = array_namespace(state.uav_pos_enu_m)
    place = state.uav_pos_enu_m
    like = {"dtype": place.dtype, "device": place.device}
    points = sample_points(scenario.max_speed_mps * scenario.slot_s, _radius_m(scenario))
    offset_m, radius_m = xp.asarray(points.offset_m, **like), xp.asarray(points.radius_m, **like)
    active = xp.astype(state.user_active, place.dtype)
    weight = active / xp.clip(xp.sum(active, axis=-1, keepdims=True), 1.0, None)
    masses = xp.stack((AOI_UNIT * state.user_aoi_slots * weight, weight), axis=-1)  # [..., M, 2]
    reach = _reach(place, state.user_pos_enu_m, offset_m, radius_m)  # [..., U, P, M]
    crowd = reach @ xp.expand_dims(masses, axis=-3)
    flying = xp.astype(state.uav_active, place.dtype)
    count = place.shape[-2]
    others = xp.ones((count, count), **like) - xp.eye(count, **like)
    near = _reach(place, place, offset_m, radius_m) * (others[:, None, :] * flying[..., None, None, :])
    spot_m = xp.expand_dims(place, axis=-2) + offset_m
    size_m = xp.asarray(scenario.area.size_m, **like)
    inside = xp.astype(xp.all((spot_m >= 0.0) & (spot_m <= size_m), axis=-1), place.dtype)
    return xp.concat((crowd, xp.sum(near, axis=-1, keepdims=True), inside[..., None]), axis=-1)


def own_features(scenario: Scenario, state: WorldState) -> Array:
    """[..., U, OWN_FEATURES]."""
    xp = array_namespace(state.uav_pos_enu_m)
    place = state.uav_pos_enu_m
    size_m = xp.asarray(scenario.area.size_m, dtype=place.dtype, device=place.device)
    one = xp.ones_like(place[..., 0])
    active = xp.astype(state.user_active, place.dtype)
    mean_aoi = xp.sum(active * state.user_aoi_slots, axis=-1) / xp.clip(xp.sum(active, axis=-1), 1.0, None)
    step_m = scenario.max_speed_mps * scenario.slot_s
    rows = (
        2.0 * place[..., 0] / size_m[0] - 1.0,
        2.0 * place[..., 1] / size_m[1] - 1.0,
        state.uav_energy_j / scenario.battery_j,
        one * (state.slot / scenario.slots),
        one * (_radius_m(scenario) / step_m),
        one * (AOI_UNIT * mean_aoi[..., None]),
    )
    return xp.stack(rows, axis=-1)


def _reach(origin_m: Array, target_m: Array, offset_m: Array, radius_m: Array) -> Array:
    """How surely each target is within reach of each point: [..., U, 2], [..., K, 2] -> [..., U, P, K] in [0, 1].

    (r^2 - d^2) / (s r^2) + 1/2, cut to [0, 1], is linear in (x, y, x^2 + y^2, 1) of the target: one product.
    """
    xp = array_namespace(origin_m)
    relative_m = target_m[..., None, :, :] - origin_m[..., :, None, :]  # [..., U, K, 2]
    squared = xp.sum(relative_m * relative_m, axis=-1, keepdims=True)
    lifted = xp.concat((relative_m, squared, xp.ones_like(squared)), axis=-1)  # [..., U, K, 4]
    softness = SOFT_SHARE * 2.0 * radius_m * radius_m
    constant = (radius_m * radius_m - xp.sum(offset_m * offset_m, axis=-1)) / softness + 0.5
    rows = xp.stack((2.0 * offset_m[:, 0], 2.0 * offset_m[:, 1], -xp.ones_like(softness)), axis=-1)
    plane = xp.concat((rows / softness[:, None], constant[:, None]), axis=-1)  # [P, 4]
    return xp.clip(plane @ xp.matrix_transpose(lifted), 0.0, 1.0)


def _radius_m(scenario: Scenario) -> float:
    """At least a hundredth of a slot's way: a radio that reaches nobody still has a finite field."""
    reach_m = _serving_radius_m(scenario.altitude_m, scenario.radio)
    return max(reach_m, 0.01 * scenario.max_speed_mps * scenario.slot_s)


_serving_radius_m = cache(serving_radius_m)
