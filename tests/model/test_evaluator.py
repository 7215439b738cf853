"""Real units out of a runner whose answers are known."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from tests_model_states import random_states, small_units

from policy.model.evaluator import AT_ONCE, NetworkEvaluator, RawOutputs, next_uavs, next_users
from policy.model.features import Features, Float32Array
from policy.model.spec import ModelSpec


class KnownRunner:
    """Costs user i + 1 slots; everybody walks one walk east; energy spent is 0.6 % of the battery."""

    spec = ModelSpec(gamma=0.9)

    def run(self, features: Features, action: Float32Array) -> RawOutputs:
        batch, users = features.user_mask.shape
        uavs = features.uav_mask.shape[1]
        cost = np.tile(np.arange(1, users + 1, dtype=np.float32), (batch, 1))
        user_next = np.zeros((batch, users, 4), dtype=np.float32)
        user_next[..., 0] = 1.0
        uav_next = np.concatenate((action, np.full((*action.shape[:3], 1), 0.006)), axis=-1).astype(np.float32)
        return RawOutputs(cost, user_next, uav_next, np.full((batch, uavs, users), 0.1, dtype=np.float32))


def test_value_is_minus_the_mean_cost_of_those_who_take_part() -> None:
    states = random_states(np.random.default_rng(0), batch=2, uavs=2, users=5)  # user 0 is absent: costs 2 .. 5 stay
    np.testing.assert_allclose(NetworkEvaluator(KnownRunner()).value(states, small_units()), [-35.0, -35.0])


def test_nobody_there_is_worth_nothing() -> None:
    states = random_states(np.random.default_rng(0), batch=1, uavs=1, users=5)
    empty = replace(states, user_active=np.zeros_like(states.user_active))
    assert NetworkEvaluator(KnownRunner()).value(empty, small_units())[0] == 0.0


def test_predicted_places_are_in_metres() -> None:
    states, units = random_states(np.random.default_rng(1), batch=1, uavs=2, users=5), small_units()
    moved = NetworkEvaluator(KnownRunner()).predict_users(states, units) - states.user_pos_enu_m
    np.testing.assert_allclose(moved, np.broadcast_to([1.3 * 15.0, 0.0], moved.shape), rtol=1e-6)


def test_a_predicted_state_has_the_meaning_of_a_real_one() -> None:
    """Eq. 12: same shapes, AoI at least 1, nobody's data below 0, the absent as they were."""
    states, units = random_states(np.random.default_rng(1), batch=2, uavs=2, users=5), small_units()
    command = np.broadcast_to([18.0, 0.0], (2, 1, 2, 2))
    after = NetworkEvaluator(KnownRunner()).predict_next(states, command, units)
    np.testing.assert_allclose(after.uav_pos_enu_m - states.uav_pos_enu_m, [[[270.0, 0.0]] * 2] * 2)
    np.testing.assert_allclose(states.uav_energy_j - after.uav_energy_j, 0.006 * units.battery_j, rtol=1e-6)
    assert np.all(after.user_aoi_slots >= 1.0)
    assert np.all(after.user_data_mb >= 0.0)
    assert np.array_equal(after.user_pos_enu_m[:, 0], states.user_pos_enu_m[:, 0])
    assert np.array_equal(after.user_aoi_slots[:, 0], states.user_aoi_slots[:, 0])


def test_each_uav_flies_its_own_command_in_each_joint_one() -> None:
    """Three joint commands of two UAVs in each of two states, a velocity of which is asked for once only."""
    states, units = random_states(np.random.default_rng(1), batch=2, uavs=2, users=5), small_units()
    states = replace(states, uav_active=np.full((2, 2), True))
    north, east, stay = (0.0, 18.0), (18.0, 0.0), (0.0, 0.0)
    command = np.array([[(north, east), (east, east), (stay, north)], [(east, stay), (north, north), (stay, stay)]])
    after = NetworkEvaluator(KnownRunner()).predict_next(states, command, units)
    way_m = after.uav_pos_enu_m - np.repeat(states.uav_pos_enu_m, 3, axis=0)
    np.testing.assert_allclose(way_m, 15.0 * command.reshape(6, 2, 2), atol=1e-4)
    np.testing.assert_array_equal(after.uav_vel_enu_mps, command.reshape(6, 2, 2))
    np.testing.assert_array_equal(after.user_pos_enu_m[0], after.user_pos_enu_m[2])


def test_many_states_are_asked_for_in_parts() -> None:
    class Counting(KnownRunner):
        sizes: ClassVar[list[int]] = []

        def run(self, features: Features, action: Float32Array) -> RawOutputs:
            self.sizes.append(features.uav.shape[0])
            return super().run(features, action)

    states, units = random_states(np.random.default_rng(1), batch=2 * AT_ONCE + 1, uavs=2, users=5), small_units()
    told = NetworkEvaluator(Counting()).predict_users(states, units)
    assert Counting.sizes == [AT_ONCE, AT_ONCE, 1]
    np.testing.assert_array_equal(told, NetworkEvaluator(KnownRunner()).predict_users(states, units))
    np.testing.assert_allclose(told[-1, 1:, 0] - states.user_pos_enu_m[-1, 1:, 0], 1.3 * 15.0)


def test_ages_and_data_come_back_from_their_logarithms() -> None:
    states, units = random_states(np.random.default_rng(1), batch=1, uavs=1, users=2), small_units(2)
    states = replace(
        states,
        user_aoi_slots=np.full((1, 2), 11.5),
        user_data_mb=np.full((1, 2), 10.5 * 0.3),
        user_active=np.full((1, 2), True),
    )
    user_next = np.zeros((1, 2, 4), dtype=np.float32)
    user_next[0, 0, 2:] = (1e3, 1e3)  # as of a network far from what it has seen
    user_next[0, 1, 2:] = (np.log(12.0) / np.log(30.0), np.log1p(11.0) / np.log(30.0))
    after = next_users(states, user_next, units)
    np.testing.assert_allclose(after.user_aoi_slots[0, 1], 12.0, rtol=1e-5)
    np.testing.assert_allclose(after.user_data_mb[0, 1], 11.0 * 0.3, rtol=1e-5)
    np.testing.assert_allclose(after.user_aoi_slots[0, 0], 12.5, rtol=1e-6)  # a slot older, no more
    np.testing.assert_allclose(after.user_data_mb[0, 0], 11.5 * 0.3, rtol=1e-6)


@pytest.mark.parametrize(("told", "spent_w"), [(-0.03, (120.0, 135.0)), (0.5, (160.0, 190.0))])
def test_a_slot_costs_no_less_and_no_more_than_flying_it_can(told: float, spent_w: tuple[float, float]) -> None:
    """Propulsion power of the paper's quadrotor: about 127 W at 10.2 m/s, 169 W hovering, the most."""
    states, units = random_states(np.random.default_rng(1), batch=1, uavs=1, users=2), small_units(2)
    uav_next = np.array([[[0.0, 0.0, told]]], dtype=np.float32)
    after = next_uavs(states, uav_next, np.zeros((1, 1, 2)), units)
    spent = float(states.uav_energy_j[0, 0] - after.uav_energy_j[0, 0]) / units.slot_s
    assert spent_w[0] <= spent <= spent_w[1]
