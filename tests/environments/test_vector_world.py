"""Many campaigns in step are the same campaigns one by one."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from policy.environments.single_world import SingleWorld
from policy.environments.vector_world import Campaigns, VectorWorld
from policy.world.scenario import Area, Obstacle, Scenario

TOWER = Obstacle("tower", 140.0, np.array([[300.0, 300.0], [360.0, 300.0], [360.0, 380.0]]))


@pytest.mark.parametrize("obstacles", [(), (TOWER,)])
@pytest.mark.parametrize("accel", [float("inf"), 4.5])
def test_each_campaign_goes_as_it_would_alone(obstacles, accel):
    rng = np.random.default_rng(2)
    scenario = Scenario(
        Area((0.0, 0.0), (1200.0, 900.0), obstacles), np.zeros((2, 2)), np.full(4, 0.03), slots=8, max_accel_mps2=accel
    )
    launches = rng.uniform(450.0, 800.0, size=(3, 2, 2))
    crowds = rng.uniform(0.0, 900.0, size=(2, 9, 4, 2))
    crowd = np.array([0, 1, 0])
    world = VectorWorld(
        Campaigns(
            scenario,
            torch.as_tensor(launches),
            torch.as_tensor(crowds),
            torch.as_tensor(crowd),
            torch.ones((3, 4), dtype=torch.bool),
        )
    )
    alone = [
        SingleWorld(replace(scenario, launch_enu_m=launches[number]), crowds[crowd[number]]) for number in range(3)
    ]
    while not world.done:
        legal = world.legal()
        for number, single in enumerate(alone):
            assert np.array_equal(legal[number].numpy(), single.legal())
        actions = torch.multinomial(legal.reshape(-1, 9).double(), 1).reshape(3, 2)
        rewards = world.step(actions)
        for number, single in enumerate(alone):
            assert single.step(actions[number].numpy()) == pytest.approx(float(rewards[number]))
            assert np.allclose(single.state.uav_pos_enu_m, world.state.uav_pos_enu_m[number].numpy())
            assert np.array_equal(single.state.user_aoi_slots, world.state.user_aoi_slots[number].numpy())
    for number, single in enumerate(alone):
        assert single.metrics()["final_aoi"] == pytest.approx(float(world.mean_aoi()[number]))


def test_who_takes_no_part_does_not_count():
    scenario = Scenario(Area((0.0, 0.0), (1000.0, 1000.0)), np.full((1, 2), 500.0), np.full(2, 0.02), slots=3)
    crowds = torch.tensor([[500.0, 500.0], [0.0, 0.0]], dtype=torch.float64).expand(1, 4, 2, 2)
    active = torch.tensor([[True, True], [True, False]])
    launch = torch.full((2, 1, 2), 500.0, dtype=torch.float64)
    world = VectorWorld(Campaigns(scenario, launch, crowds, torch.zeros(2, dtype=torch.long), active))
    while not world.done:
        world.step(torch.zeros((2, 1), dtype=torch.long))  # hover over the first user
    assert world.mean_aoi().tolist() == [2.5, 1.0]
