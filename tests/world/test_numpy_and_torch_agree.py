"""The same functions on NumPy and on torch give the same numbers."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scenarios import TOWER, make_scenario

from policy.world.airspace import legal_moves
from policy.world.frames import heading_rad
from policy.world.reward import reward
from policy.world.state import JointAction, WorldState
from policy.world.transition import step


def to_torch(state: WorldState) -> WorldState:
    values = {f.name: torch.as_tensor(getattr(state, f.name)) for f in fields(state) if f.name != "slot"}
    return replace(state, **values)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from([math.inf, 4.5]))
def test_one_slot(seed: int, accel: float) -> None:
    rng = np.random.default_rng(seed)
    scenario = make_scenario(num_uavs=3, num_users=7, accel=accel, obstacles=(TOWER,))
    state = WorldState(
        slot=4,
        uav_pos_enu_m=rng.uniform(0, 1200, (2, 3, 2)),
        uav_vel_enu_mps=rng.uniform(-12, 12, (2, 3, 2)),
        uav_energy_j=rng.uniform(0, 9e4, (2, 3)),
        uav_active=rng.random((2, 3)) < 0.8,
        user_pos_enu_m=rng.uniform(0, 1200, (2, 7, 2)),
        user_data_mb=rng.uniform(0, 3, (2, 7)),
        user_aoi_slots=rng.integers(1, 9, (2, 7)).astype(float),
        user_active=rng.random((2, 7)) < 0.8,
    )
    action = JointAction(rng.uniform(0, 6.28, (2, 3)), rng.uniform(0, 18, (2, 3)))
    users = rng.uniform(0, 1200, (2, 7, 2))
    after, outcome = step(scenario, state, action, users)
    other_action = JointAction(torch.as_tensor(action.heading_rad), torch.as_tensor(action.speed_mps))
    other, other_outcome = step(scenario, to_torch(state), other_action, torch.as_tensor(users))
    for field in fields(after):
        assert np.allclose(np.asarray(getattr(after, field.name)), np.asarray(getattr(other, field.name)), atol=1e-9)
    for field in fields(outcome):
        assert np.allclose(getattr(outcome, field.name), np.asarray(getattr(other_outcome, field.name)), atol=1e-9)
    ours = reward(scenario, state, after, outcome)
    theirs = reward(scenario, to_torch(state), other, other_outcome)
    assert np.allclose(ours, theirs.numpy(), atol=1e-9)


def test_types_are_kept() -> None:
    scenario = make_scenario(accel=4.5)
    position = torch.tensor([800.0, 600.0], dtype=torch.float32)
    legal = legal_moves(position, torch.zeros(2), torch.tensor([[0.0, 18.0], [18.0, 0.0]]), scenario)
    assert isinstance(legal, torch.Tensor)
    assert heading_rad(position).dtype == torch.float32
    with pytest.raises(TypeError):
        legal_moves(position, np.zeros(2), torch.zeros(2), scenario)
