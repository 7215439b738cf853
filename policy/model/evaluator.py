"""What search and agents ask of a network, whichever library runs it."""

from dataclasses import replace
from functools import cache
from typing import NamedTuple, Protocol

import numpy as np

from policy.model.features import AOI_SCALE_SLOTS, LEAST_SLOT_MB, Features, Float32Array, action_features, make_features
from policy.model.forecast import Forecaster, UserForecast
from policy.model.history import StepHistory
from policy.model.spec import ModelSpec
from policy.model.states import StateBatch, Units, push_step, take
from policy.world.arrays import FloatArray
from policy.world.energy import propulsion_power_w
from policy.world.state import WorldState

AT_ONCE = 48
"""States a run. Relations between 62 nodes are 15 kB a state: of 729 at once each took 2.5 times as long as of 27."""
SPEEDS = 181
"""Looked at for the least and the most energy of a slot, from hovering to full speed."""


class RawOutputs(NamedTuple):
    """The network's heads as arrays, in its own units (see ``network.Outputs``)."""

    user_cost_slots: Float32Array  # [B, M]
    user_next: Float32Array  # [B, M, 4]
    uav_next: Float32Array  # [B, U, A, 3]
    relations: Float32Array  # [B, U, M]


class Runner(Protocol):
    """Runs the network forward; the torch module and the exported graph are two."""

    spec: ModelSpec

    def run(self, features: Features, action: Float32Array) -> RawOutputs:
        """Features and A actions of each UAV [B, U, A, 2] -> heads."""


class Evaluator(Protocol):
    """Batched answers in real units."""

    spec: ModelSpec

    def value(self, states: StateBatch, units: Units) -> FloatArray:
        """[B]: higher is better; see :class:`NetworkEvaluator`."""

    def predict_users(self, states: StateBatch, units: Units) -> FloatArray:
        """Users' places at the next sample [B, M, 2] in metres."""

    def predict_next(self, states: StateBatch, vel_command_mps: FloatArray, units: Units) -> StateBatch:
        """sigma_{t+1}(s_t, a_t) of Eq. 12 for joint commands of each state [B, C, U, 2]: [B C], a state's in a row."""

    def relations(self, states: StateBatch, units: Units) -> FloatArray:
        """How much each UAV attends to each user [B, U, M], Eq. 11d."""

    def forecast_users(self, state: WorldState, history: StepHistory, units: Units) -> UserForecast:
        """Users' places in each of the next slots and how far off they may be, from ``state`` without batch."""


class NetworkEvaluator:
    """Features in, real units out, around a :class:`Runner`.

    The value is minus the discounted AoI ahead, -sum_k gamma^(k-1) mean_m kappa_{t+k}^m in slots. With the AoI part of
    Eq. 8 alone the discounted reward ahead is c_AoI (mean kappa_t + (1 - gamma) value): the same order of states.
    """

    def __init__(self, runner: Runner, forecaster: Forecaster | None = None) -> None:
        self._runner, self._forecaster = runner, forecaster
        self.spec = runner.spec

    def value(self, states: StateBatch, units: Units) -> FloatArray:
        """Minus the discounted sum of mean AoI ahead [B]; 0 where nobody takes part."""
        cost_slots = self._run(states, units).user_cost_slots.astype(np.float64)
        weight = states.user_active.astype(np.float64)
        mean = np.sum(cost_slots * weight, axis=1) / np.maximum(np.sum(weight, axis=1), 1.0)
        return np.asarray(-mean / (1.0 - self.spec.gamma))

    def predict_users(self, states: StateBatch, units: Units) -> FloatArray:
        """Places at the next sample [B, M, 2] metres."""
        way = self._run(states, units).user_next[..., :2].astype(np.float64)
        return np.asarray(states.user_pos_enu_m + way * units.walk_m)

    def predict_next(self, states: StateBatch, vel_command_mps: FloatArray, units: Units) -> StateBatch:
        """The learned next states in the units of the present ones.

        f_1 knows a UAV's own action only: it is asked once for each velocity that is commanded, not for each joint
        command. Users go the same way whatever is commanded (Eq. 12).
        """
        nodes, count, uavs = vel_command_mps.shape[:3]
        single_mps, which = np.unique(vel_command_mps.reshape(-1, 2), axis=0, return_inverse=True)
        raw = self._run(states, units, np.broadcast_to(single_mps, (nodes, uavs, *single_mps.shape)))
        each = np.repeat(np.arange(nodes), count)
        told = raw.uav_next[each[:, None], np.arange(uavs), which.reshape(nodes * count, uavs)]
        moved = take(next_users(states, raw.user_next, units), each)
        return next_uavs(moved, told, vel_command_mps.reshape(nodes * count, uavs, 2), units)

    def relations(self, states: StateBatch, units: Units) -> FloatArray:
        """[B, U, M]; what a UAV gives to other UAVs and itself is the rest to one."""
        return self._run(states, units).relations.astype(np.float64)

    def forecast_users(self, state: WorldState, history: StepHistory, units: Units) -> UserForecast:
        """By the forecaster given; ValueError where there is none."""
        if self._forecaster is None:
            raise ValueError("this evaluator was made without a forecaster: give one, or use_forecast=False")
        return self._forecaster.forecast(state, history, units.walk_m)

    def _run(self, states: StateBatch, units: Units, vel_command_mps: FloatArray | None = None) -> RawOutputs:
        """Heads of states [B] for commands [B, U, A, 2], as many states at a time as a processor's cache holds."""
        if vel_command_mps is None:
            vel_command_mps = np.zeros((*states.uav_vel_enu_mps.shape[:2], 1, 2))
        parts = []
        for first in range(0, max(states.size, 1), AT_ONCE):
            rows = slice(first, first + AT_ONCE)
            action = action_features(vel_command_mps[rows], units)
            parts.append(self._runner.run(make_features(take(states, rows), units), action))
        return parts[0] if len(parts) == 1 else RawOutputs(*map(np.concatenate, zip(*parts, strict=True)))


def next_users(states: StateBatch, user_next: Float32Array, units: Units) -> StateBatch:
    """Head f_2 [B, M, 4] in real units; the absent unchanged, UAVs as they are.

    AoI and data stay within what a slot can do (Eq. 1-4): at least 1 and 0, at most a slot older, a slot's data more. A
    network asked about its own answers would else drift out of what it has seen, without bounds.
    """
    told, present = user_next.astype(np.float64), states.user_active
    step_m = np.where(present[..., None], told[..., :2] * units.walk_m, 0.0)
    aoi_slots = _power(told[..., 2], states.user_aoi_slots + 1.0)
    slot_mb = np.maximum(units.slot_data_mb, LEAST_SLOT_MB)
    data_mb = (_power(told[..., 3], states.user_data_mb / slot_mb + 2.0) - 1.0) * units.slot_data_mb
    return replace(
        states,
        user_pos_enu_m=states.user_pos_enu_m + step_m,
        user_steps_m=push_step(states.user_steps_m, step_m),
        user_data_mb=np.where(present, data_mb, states.user_data_mb),
        user_aoi_slots=np.where(present, aoi_slots, states.user_aoi_slots),
    )


def next_uavs(states: StateBatch, uav_next: Float32Array, vel_command_mps: FloatArray, units: Units) -> StateBatch:
    """Head f_1 [B, U, 3] for commands [B, U, 2] in real units; who does not fly unchanged, users as they are.

    Energy is at least 0, and what is spent within the least and the most that a slot at one speed costs.
    """
    told, flying = uav_next.astype(np.float64), states.uav_active
    spent_j = np.clip(told[..., 2] * units.battery_j, *_slot_energy_j(units.max_speed_mps, units.slot_s))
    energy_j = np.maximum(states.uav_energy_j - spent_j, 0.0)
    return replace(
        states,
        uav_pos_enu_m=states.uav_pos_enu_m + np.where(flying[..., None], told[..., :2] * units.reach_m, 0.0),
        uav_vel_enu_mps=np.where(flying[..., None], vel_command_mps, 0.0),
        uav_energy_j=np.where(flying, energy_j, states.uav_energy_j),
    )


@cache
def _slot_energy_j(max_speed_mps: float, slot_s: float) -> tuple[float, float]:
    """Least and most of a slot at one speed, J."""
    used_j = slot_s * propulsion_power_w(np.linspace(0.0, max_speed_mps, SPEEDS))
    return float(np.min(used_j)), float(np.max(used_j))


def _power(exponent: FloatArray, most: FloatArray) -> FloatArray:
    """AOI_SCALE_SLOTS to the power of ``exponent``, from 1 to ``most``; bounded before it can overflow."""
    highest = np.log(most) / np.log(AOI_SCALE_SLOTS)
    return np.asarray(AOI_SCALE_SLOTS ** np.clip(exponent, 0.0, highest))
