"""One slot: UAVs fly, users move, data is uploaded (Section III; timing as in Def. 1 and 2).

UAVs move during slot t; service is judged at its end, with users at sample t+1 and UAVs where they are then.
"""

from dataclasses import dataclass

from policy.world.airspace import hits_obstacle, inside_area
from policy.world.arrays import Array, array_namespace
from policy.world.channel import served
from policy.world.energy import used_energy_j
from policy.world.freshness import next_aoi_slots, next_data_mb
from policy.world.geometry import pairwise_distance_m
from policy.world.motion import end_velocity_mps, slot_path_m
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState


@dataclass(frozen=True)
class Outcome:
    """What happened in a slot beside the new state."""

    served: Array  # bool [..., M]
    energy_j: Array  # [..., U] spent in the slot
    left_area: Array  # bool [..., U]
    hit_obstacle: Array  # bool [..., U]
    ran_empty: Array  # bool [..., U], in this slot


def step(
    scenario: Scenario, state: WorldState, action: JointAction, next_user_pos_enu_m: Array
) -> tuple[WorldState, Outcome]:
    """Fly ``action`` through the slot: users end at ``next_user_pos_enu_m`` [..., M, 2]."""
    xp = array_namespace(state.uav_pos_enu_m)
    commanded = xp.where(state.uav_active[..., None], action.vel_enu_mps, 0.0 * action.vel_enu_mps)
    end_mps = action.end_vel_enu_mps
    end_mps = None if end_mps is None else xp.where(state.uav_active[..., None], end_mps, 0.0 * end_mps)
    path_m, speeds_mps = slot_path_m(
        state.uav_pos_enu_m, state.uav_vel_enu_mps, commanded, scenario.max_accel_mps2, scenario.slot_s, end_mps
    )
    spent_j = used_energy_j(speeds_mps, scenario.slot_s)
    spent_j = xp.where(state.uav_active, spent_j, 0.0 * spent_j)
    remaining_j = state.uav_energy_j - spent_j
    ran_empty = state.uav_active & (remaining_j <= 0.0)
    flying = state.uav_active & ~ran_empty
    left_area = state.uav_active & ~xp.all(inside_area(path_m, scenario), axis=-1)
    hit = state.uav_active & xp.any(hits_obstacle(path_m, scenario), axis=-1)
    end_vel = end_velocity_mps(state.uav_vel_enu_mps, commanded, scenario.max_accel_mps2, scenario.slot_s, end_mps)
    after, was_served = serve(scenario, state, path_m[..., -1, :], flying, next_user_pos_enu_m)
    moved = WorldState(
        slot=state.slot + 1,
        uav_pos_enu_m=path_m[..., -1, :],
        uav_vel_enu_mps=end_vel,
        uav_energy_j=xp.clip(remaining_j, 0.0, None),
        uav_active=flying,
        user_pos_enu_m=next_user_pos_enu_m,
        user_data_mb=after[0],
        user_aoi_slots=after[1],
        user_active=state.user_active,
    )
    return moved, Outcome(was_served, spent_j, left_area, hit, ran_empty)


def serve(
    scenario: Scenario, state: WorldState, uav_pos_enu_m: Array, flying: Array, next_user_pos_enu_m: Array
) -> tuple[tuple[Array, Array], Array]:
    """The end of a slot: ((data [..., M], AoI [..., M]), served bool [..., M]) by Eq. 1-4.

    ``uav_pos_enu_m`` [..., U, 2] and ``flying`` bool [..., U] at the slot's end.
    """
    distance_m = pairwise_distance_m(uav_pos_enu_m, next_user_pos_enu_m)
    was_served = served(distance_m, flying, scenario.altitude_m, scenario.radio) & state.user_active
    xp = array_namespace(distance_m)
    rate = xp.asarray(scenario.collect_mbps, dtype=state.user_data_mb.dtype)
    data = next_data_mb(state.user_data_mb, was_served, rate, scenario.slot_s)
    aoi = next_aoi_slots(state.user_aoi_slots, was_served)
    keep = state.user_active
    return (xp.where(keep, data, state.user_data_mb), xp.where(keep, aoi, state.user_aoi_slots)), was_served
