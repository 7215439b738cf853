"""What a UAV sees, against counting by hand."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from policy.environments.field import AOI_UNIT, NUM_FEATURES, NUM_POINTS, features, freshness_field, sample_points
from policy.world.scenario import Area, Scenario
from policy.world.state import initial_state

SCENARIO = Scenario(Area((0.0, 0.0), (2000.0, 1500.0)), np.array([[1000.0, 700.0], [300.0, 200.0]]), np.full(3, 0.02))


def state_of(users, ages):
    state = initial_state(SCENARIO, np.asarray(users, dtype=float))
    return replace(state, user_aoi_slots=np.asarray(ages, dtype=float))


def test_users_within_reach_of_each_landing_point_are_counted():
    step_m, reach_m = 270.0, SCENARIO.serving_radius_m
    state = state_of([[1000.0, 700.0], [1000.0, 700.0 + step_m], [1900.0, 1400.0]], [4.0, 7.0, 2.0])
    field = freshness_field(SCENARIO, state)
    assert field.shape == (2, NUM_POINTS, 4)
    assert field[0, 0, 0] == pytest.approx(AOI_UNIT * 4.0 / 3.0)  # hovering serves the first
    assert field[0, 1, 0] == pytest.approx(AOI_UNIT * 7.0 / 3.0)  # north serves the second
    assert field[0, 1, 1] == pytest.approx(1.0 / 3.0)
    assert field[0, 5, 0] == pytest.approx(0.0)  # south serves nobody
    assert reach_m < step_m


def test_the_other_uav_and_the_edge_are_seen():
    field = freshness_field(SCENARIO, state_of([[0.0, 0.0]] * 3, [1.0] * 3))
    points = sample_points(270.0, SCENARIO.serving_radius_m)
    toward = np.argmin(np.linalg.norm(points.offset_m - np.array([-700.0, -500.0]), axis=1))
    assert field[0, toward, 2] == 1.0
    assert field[0, 0, 2] == 0.0
    places = SCENARIO.launch_enu_m[:, None] + points.offset_m
    inside = np.all((places >= 0.0) & (places <= np.array([2000.0, 1500.0])), axis=-1)
    assert np.array_equal(field[..., 3] > 0.5, inside)


@settings(deadline=None)
@given(st.integers(0, 2**31 - 1))
def test_the_order_of_users_does_not_matter_and_torch_agrees(seed):
    rng = np.random.default_rng(seed)
    users, ages = rng.uniform(0.0, (2000.0, 1500.0), size=(3, 2)), rng.integers(1, 60, size=3)
    seen = features(SCENARIO, state_of(users, ages))
    assert seen.shape == (2, NUM_FEATURES)
    assert np.isfinite(seen).all()
    turned = features(SCENARIO, state_of(users[::-1], ages[::-1]))
    assert np.allclose(seen, turned, atol=1e-12)
    state = state_of(users, ages)
    tensors = replace(
        state,
        **{name: torch.as_tensor(np.asarray(value))[None] for name, value in vars(state).items() if name != "slot"},
    )
    assert np.allclose(features(SCENARIO, tensors)[0].numpy(), seen, atol=1e-9)
