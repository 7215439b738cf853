"""Where an action leads (Eq. 12) and what it earns (Eq. 8): by the world's physics, learned, or each where it is best.

``exact``: UAV motion, energy, service, data and AoI by ``policy.world``, users stay. ``hybrid``: the same with users
where f_2 predicts them. ``learned``: everything by f_1 and f_2, the paper's variant.
"""

import numpy as np

from policy.model.evaluator import Evaluator
from policy.model.states import StateBatch, Units, push_step
from policy.search.paper_tree import NextState
from policy.world.arrays import FloatArray
from policy.world.frames import heading_rad
from policy.world.reward import reward
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState
from policy.world.transition import Outcome, step

NEXT_STATES = ("exact", "hybrid", "learned")


def next_state(kind: str, scenario: Scenario, evaluator: Evaluator, units: Units) -> NextState:
    """By its name in ``NEXT_STATES``; ValueError for another."""
    if kind == "learned":
        return Learned(scenario, evaluator, units)
    if kind in NEXT_STATES:
        return Physics(scenario, evaluator if kind == "hybrid" else None, units)
    raise ValueError(f"next_state {kind!r} is unknown: choose one of {', '.join(NEXT_STATES)}")


class Physics:
    """The world's own slot; users stay, or go where ``evaluator`` predicts."""

    def __init__(self, scenario: Scenario, evaluator: Evaluator | None, units: Units) -> None:
        self._scenario, self._evaluator, self._units = scenario, evaluator, units

    def __call__(self, states: StateBatch, vel_command_mps: FloatArray) -> tuple[StateBatch, FloatArray]:
        """States [B], commands [B, U, 2] -> next states, rewards [B]."""
        place_m = states.user_pos_enu_m
        if self._evaluator is not None:
            predicted_m = self._evaluator.predict_users(states, self._units)
            place_m = np.where(states.user_active[..., None], predicted_m, place_m)
        speed_mps = np.hypot(vel_command_mps[..., 0], vel_command_mps[..., 1])
        before = world_state(states)
        after, outcome = step(self._scenario, before, JointAction(heading_rad(vel_command_mps), speed_mps), place_m)
        moved = StateBatch(
            uav_pos_enu_m=after.uav_pos_enu_m,
            uav_vel_enu_mps=after.uav_vel_enu_mps,
            uav_energy_j=after.uav_energy_j,
            uav_active=after.uav_active,
            user_pos_enu_m=place_m,
            user_steps_m=push_step(states.user_steps_m, place_m - states.user_pos_enu_m),
            user_data_mb=after.user_data_mb,
            user_aoi_slots=after.user_aoi_slots,
            user_active=states.user_active,
        )
        return moved, np.asarray(reward(self._scenario, before, after, outcome))


class Learned:
    """f_1 and f_2; the reward follows from the two states."""

    def __init__(self, scenario: Scenario, evaluator: Evaluator, units: Units) -> None:
        self._scenario, self._evaluator, self._units = scenario, evaluator, units

    def __call__(self, states: StateBatch, vel_command_mps: FloatArray) -> tuple[StateBatch, FloatArray]:
        """States [B], commands [B, U, 2] -> next states, rewards [B]."""
        after = self._evaluator.predict_next(states, vel_command_mps, self._units)
        nobody = np.zeros(states.uav_active.shape, dtype=np.bool_)
        outcome = Outcome(
            served=after.user_aoi_slots < states.user_aoi_slots,
            energy_j=states.uav_energy_j - after.uav_energy_j,
            left_area=nobody,
            hit_obstacle=nobody,
            ran_empty=nobody,
        )
        return after, np.asarray(reward(self._scenario, world_state(states), world_state(after), outcome))


class LearnedValue:
    """f_val in the unit of the reward: c (mean kappa - (1 - gamma) sum gamma^(k-1) kappa_{t+k}), see ``Evaluator``."""

    def __init__(self, scenario: Scenario, evaluator: Evaluator, units: Units) -> None:
        goal = scenario.objective
        self._price = goal.c_aoi + goal.c_collect * float(np.mean(units.slot_data_mb) if units.slot_data_mb.size else 0)
        self._evaluator, self._units = evaluator, units

    def __call__(self, states: StateBatch) -> FloatArray:
        """[B]."""
        weight = states.user_active.astype(np.float64)
        mean_slots = np.sum(states.user_aoi_slots * weight, axis=1) / np.maximum(np.sum(weight, axis=1), 1.0)
        ahead = self._evaluator.value(states, self._units)
        return np.asarray(self._price * (mean_slots + (1.0 - self._evaluator.spec.gamma) * ahead))


def world_state(states: StateBatch) -> WorldState:
    """The same batch as the world knows it; the slot does not matter to a step."""
    shared = {f: getattr(states, f) for f in WorldState.__dataclass_fields__ if f != "slot"}
    return WorldState(slot=0, **shared)
