from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from tests_model_states import random_states, small_units

from policy.model.features import FAR, MAX_WALKS, UAV_FEATURES, USER_FEATURES, action_features, make_features
from policy.model.states import StateBatch, Units

SHIFT_M = st.floats(-5e4, 5e4)


def test_shapes_and_type(states: StateBatch, units: Units) -> None:
    features = make_features(states, units)
    assert features.uav.shape == (3, 2, UAV_FEATURES)
    assert features.user.shape == (3, 7, USER_FEATURES)
    assert features.uav.dtype == features.user.dtype == np.float32


def test_hand_calculation(units: Units) -> None:
    """One UAV at (270, 0), one user at (0, 0) with AoI 30 who walked 19.5 m north: reach is 270 m, a walk 19.5 m."""
    states = StateBatch(
        uav_pos_enu_m=np.array([[[270.0, 0.0]]]),
        uav_vel_enu_mps=np.array([[[0.0, 9.0]]]),
        uav_energy_j=np.array([[units.battery_j / 4]]),
        uav_active=np.array([[True]]),
        user_pos_enu_m=np.zeros((1, 1, 2)),
        user_steps_m=np.array([[[[0.0, 19.5], [39.0, 0.0], [0.0, 0.0], [-1e4, 0.0]]]]),
        user_data_mb=np.array([[29 * 0.3]]),
        user_aoi_slots=np.array([[30.0]]),
        user_active=np.array([[True]]),
    )
    features = make_features(states, replace(units, slot_data_mb=np.array([0.3])))
    radius = units.serving_radius_m / 270.0
    np.testing.assert_allclose(features.uav[0, 0], [1, 0, 0, 0.5, 0.25, radius, np.log(2), 36 / 4.5 / 15], rtol=1e-5)
    np.testing.assert_allclose(
        features.user[0, 0],
        [0, 0, 0, 1, 2, 0, 0, 0, -MAX_WALKS, 0, 1, 1, 1, 1, 0, 1, 1 - radius, FAR - radius, radius],
        rtol=1e-5,
    )


@given(SHIFT_M, SHIFT_M)
def test_the_place_on_the_map_does_not_matter(east_m: float, north_m: float) -> None:
    """Weights learned in one place fit another: features depend on where things are to each other only."""
    states = random_states(np.random.default_rng(3), batch=2, uavs=2, users=5)
    shift = np.array([east_m, north_m])
    moved = replace(states, uav_pos_enu_m=states.uav_pos_enu_m + shift, user_pos_enu_m=states.user_pos_enu_m + shift)
    here, there = make_features(states, small_units()), make_features(moved, small_units())
    np.testing.assert_allclose(here.uav, there.uav, atol=1e-5)
    np.testing.assert_allclose(here.user, there.user, atol=1e-5)


def test_a_uav_that_does_not_fly_reaches_nobody(states: StateBatch, units: Units) -> None:
    grounded = replace(states, uav_active=np.zeros_like(states.uav_active))
    features = make_features(grounded, units)
    assert np.all(features.user[..., 15] == FAR)
    assert np.all(features.user[..., 13:15] == 0.0)
    assert np.all(np.isfinite(features.user))


def test_actions_in_units_of_the_greatest_speed(units: Units) -> None:
    np.testing.assert_allclose(action_features(np.array([[[18.0, -9.0]]]), units), [[[1.0, -0.5]]])


def test_the_nearest_and_the_second_of_those_that_fly_count() -> None:
    """Five UAVs at random against their sorted distances; one of them, the nearest, is down."""
    states, units = random_states(np.random.default_rng(3), batch=4, uavs=5, users=7), small_units(7)
    distance_m = np.linalg.norm(states.uav_pos_enu_m[:, :, None] - states.user_pos_enu_m[:, None], axis=-1)
    active = np.full((4, 5), True)
    active[:, 0] = False
    place_m = states.uav_pos_enu_m.copy()
    place_m[:, 0] = states.user_pos_enu_m[:, 0]
    user = make_features(replace(states, uav_active=active, uav_pos_enu_m=place_m), units).user
    ordered = np.sort(distance_m[:, 1:], axis=1) / units.reach_m
    radius = units.serving_radius_m / units.reach_m
    np.testing.assert_allclose(user[..., -4], np.minimum(ordered[:, 0], FAR), rtol=1e-5)
    np.testing.assert_allclose(user[..., -3], np.maximum(np.minimum(ordered[:, 0], FAR) - radius, 0.0), atol=1e-5)
    np.testing.assert_allclose(user[..., -2], np.maximum(np.minimum(ordered[:, 1], FAR) - radius, 0.0), atol=1e-5)
