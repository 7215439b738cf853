"""The states in which a search ends, in one batch, for a value function to score them."""

from typing import Protocol

import numpy as np

from policy.search.kernel import Beam
from policy.search.problem import Problem
from policy.world.arrays import FloatArray, IntArray
from policy.world.state import WorldState


class LeafValue(Protocol):
    """A learned (or any other) price of what comes after the horizon."""

    def __call__(self, states: WorldState) -> FloatArray:
        """States with one batch dimension B (every field but ``slot``) -> [B], the discounted sum of mean AoI
        expected after them, counted from them; lower is better.
        """


def leaf_states(problem: Problem, beam: Beam, uav: int, actions: IntArray, path_enu_m: FloatArray) -> WorldState:
    """The last layer of one UAV's beam, the others at the ends of their plans: batch B = K'.

    ``actions`` [U, H] and ``path_enu_m`` [U, H, 2] are the plans; those of ``uav`` are replaced by the beam's.
    """
    batch, state = beam.cost.shape[0], problem.state
    vel = problem.moves.table.end_mps
    last = np.repeat(actions[None, :, -1], batch, axis=0)
    last[:, uav] = beam.actions[:, -1]
    pos_m = np.repeat(path_enu_m[None, :, -1], batch, axis=0)
    pos_m[:, uav] = beam.path_m[:, -1]
    energy_j = np.repeat((state.uav_energy_j - spent_j(problem, actions))[None], batch, axis=0)
    energy_j[:, uav] = state.uav_energy_j[uav] - path_energy_j(problem, uav, beam.actions)
    aoi, data_mb = _users_after(problem, beam)
    return WorldState(
        slot=state.slot + problem.horizon_slots,
        uav_pos_enu_m=pos_m,
        uav_vel_enu_mps=np.where(state.uav_active[:, None], vel[last], 0.0),
        uav_energy_j=np.clip(energy_j, 0.0, None),
        uav_active=np.repeat(state.uav_active[None], batch, axis=0),
        user_pos_enu_m=np.repeat(problem.user_pos_enu_m[None, -1], batch, axis=0),
        user_data_mb=data_mb,
        user_aoi_slots=aoi,
        user_active=np.repeat(state.user_active[None], batch, axis=0),
    )


def spent_j(problem: Problem, actions: IntArray) -> FloatArray:
    """Energy that plans [U, H] take: [U]; none for UAVs that do not fly."""
    each = [path_energy_j(problem, uav, plan[None])[0] for uav, plan in enumerate(actions)]
    return np.where(problem.state.uav_active, each, 0.0)


def path_energy_j(problem: Problem, uav: int, actions: IntArray) -> FloatArray:
    """Energy that one UAV's paths [K, H] take: [K]."""
    start = problem.start(uav)
    before = np.concatenate((np.full((actions.shape[0], 1), start.allowed.shape[1]), actions[:, :-1]), axis=1)
    return np.asarray(start.energy_j[before, actions].sum(axis=1), dtype=np.float64)


def _users_after(problem: Problem, beam: Beam) -> tuple[FloatArray, FloatArray]:
    """AoI [B, M] and data [B, M]: whoever was served within the horizon has gathered data since then only."""
    state, horizon = problem.state, problem.horizon_slots
    batch = beam.cost.shape[0]
    aoi = np.repeat(state.user_aoi_slots[None].astype(np.float64), batch, axis=0)
    data_mb = np.repeat(state.user_data_mb[None].astype(np.float64), batch, axis=0)
    part = np.flatnonzero(state.user_active)
    after = beam.aoi_slots[:, : part.size].astype(np.float64)
    slot_mb = problem.scenario.collect_mbps[part] * problem.scenario.slot_s
    fresh = after < state.user_aoi_slots[part] + horizon
    aoi[:, part] = after
    data_mb[:, part] = np.where(fresh, (after - 1.0) * slot_mb, state.user_data_mb[part] + horizon * slot_mb)
    return aoi, data_mb
