"""Where an action leads (Eq. 12) and what it earns (Eq. 8): by the world's physics, learned, or each where it is best.

``exact``: UAV motion, energy, service, data and AoI by ``policy.world``, users stay. ``hybrid``: the same with users
where f_2 predicts them. ``learned``: UAVs and their energy by f_1, users by f_2, data and AoI by Def. 1 and 2 there.
``printed``: the same with f_2's data and AoI, the letter of Eq. 12.
"""

from dataclasses import replace

import numpy as np

from policy.model.evaluator import Evaluator
from policy.model.states import StateBatch, Units, push_step, take
from policy.search.paper_tree import NextState
from policy.world.arrays import FloatArray
from policy.world.frames import heading_rad
from policy.world.reward import reward
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState
from policy.world.transition import Outcome, serve, step

NEXT_STATES = ("exact", "hybrid", "learned", "printed")


def next_state(kind: str, scenario: Scenario, evaluator: Evaluator, units: Units) -> NextState:
    """By its name in ``NEXT_STATES``; ValueError for another."""
    if kind in ("learned", "printed"):
        return Learned(scenario, evaluator, units, printed=kind == "printed")
    if kind in NEXT_STATES:
        return Physics(scenario, evaluator if kind == "hybrid" else None, units)
    raise ValueError(f"next_state {kind!r} is unknown: choose one of {', '.join(NEXT_STATES)}")


class Physics:
    """The world's own slot; users stay, or go where ``evaluator`` predicts."""

    def __init__(self, scenario: Scenario, evaluator: Evaluator | None, units: Units) -> None:
        self._scenario, self._evaluator, self._units = scenario, evaluator, units

    def __call__(self, states: StateBatch, vel_command_mps: FloatArray) -> tuple[StateBatch, FloatArray]:
        """States [B], commands [B, C, U, 2] -> next states [B C], rewards [B, C]."""
        place_m = states.user_pos_enu_m
        if self._evaluator is not None:
            predicted_m = self._evaluator.predict_users(states, self._units)
            place_m = np.where(states.user_active[..., None], predicted_m, place_m)
        start, command = _each(states, vel_command_mps)
        place_m = np.repeat(place_m, vel_command_mps.shape[1], axis=0)
        speed_mps = np.hypot(command[..., 0], command[..., 1])
        before = world_state(start)
        after, outcome = step(self._scenario, before, JointAction(heading_rad(command), speed_mps), place_m)
        moved = StateBatch(
            uav_pos_enu_m=after.uav_pos_enu_m,
            uav_vel_enu_mps=after.uav_vel_enu_mps,
            uav_energy_j=after.uav_energy_j,
            uav_active=after.uav_active,
            user_pos_enu_m=place_m,
            user_steps_m=push_step(start.user_steps_m, place_m - start.user_pos_enu_m),
            user_data_mb=after.user_data_mb,
            user_aoi_slots=after.user_aoi_slots,
            user_active=start.user_active,
        )
        earned = np.asarray(reward(self._scenario, before, after, outcome))
        return moved, earned.reshape(vel_command_mps.shape[:2])


class Learned:
    """f_1 and f_2. The reward is Eq. 8 by Def. 1 and 2 where they say that UAVs and users will be.

    f_2 is not told the action (Eq. 12), so its own data and AoI cannot say whom an action serves. They are what
    ``printed`` goes on from; ``learned`` goes on from Def. 1 and 2 at the predicted places.
    """

    def __init__(self, scenario: Scenario, evaluator: Evaluator, units: Units, printed: bool) -> None:
        self._scenario, self._evaluator, self._units, self._printed = scenario, evaluator, units, printed

    def __call__(self, states: StateBatch, vel_command_mps: FloatArray) -> tuple[StateBatch, FloatArray]:
        """States [B], commands [B, C, U, 2] -> next states [B C], rewards [B, C]."""
        start, _ = _each(states, vel_command_mps)
        predicted = self._evaluator.predict_next(states, vel_command_mps, self._units)
        ran_empty = start.uav_active & (predicted.uav_energy_j <= 0.0)
        predicted = replace(predicted, uav_active=start.uav_active & ~ran_empty)
        before = world_state(start)
        (data_mb, aoi_slots), served = serve(
            self._scenario, before, predicted.uav_pos_enu_m, predicted.uav_active, predicted.user_pos_enu_m
        )
        known = replace(predicted, user_data_mb=data_mb, user_aoi_slots=aoi_slots)
        nobody = np.zeros_like(ran_empty)  # what leaves the area or hits an obstacle is not tried
        outcome = Outcome(served, start.uav_energy_j - predicted.uav_energy_j, nobody, nobody, ran_empty)
        earned = np.asarray(reward(self._scenario, before, world_state(known), outcome))
        return predicted if self._printed else known, earned.reshape(vel_command_mps.shape[:2])


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


def _each(states: StateBatch, vel_command_mps: FloatArray) -> tuple[StateBatch, FloatArray]:
    """States [B] once for each of their commands [B, C, U, 2] -> states [B C], commands [B C, U, 2]."""
    nodes, count = vel_command_mps.shape[:2]
    return take(states, np.repeat(np.arange(nodes), count)), vel_command_mps.reshape(nodes * count, -1, 2)


def world_state(states: StateBatch) -> WorldState:
    """The same batch as the world knows it; the slot does not matter to a step."""
    shared = {f: getattr(states, f) for f in WorldState.__dataclass_fields__ if f != "slot"}
    return WorldState(slot=0, **shared)
