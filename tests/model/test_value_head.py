"""What waits is bounded around what it would be if the nearest UAV came at once."""

import math

import numpy as np
import pytest
import torch

from policy.model.features import (
    AOI_SCALE_SLOTS,
    UAV_FEATURES,
    USER_AOI_COLUMN,
    USER_FEATURES,
    USER_SLOTS_COLUMN,
    make_features,
)
from policy.model.network import ADDS_SCALE, IN_RANGE_SLOTS, MOST, GcrlNetwork
from policy.model.spec import ModelSpec
from policy.model.states import STEPS, Units, stack_states
from policy.world.scenario import Area, Scenario
from policy.world.state import initial_state

AGES_SLOTS = torch.tensor([1.0, 5.0, 40.0])
WAYS_SLOTS = torch.tensor([0.0, 2.5, 11.0])


def costs(network: GcrlNetwork, seed: int = 0) -> torch.Tensor:
    """Of three users with those ages and ways, whatever else is seen."""
    draw = torch.Generator().manual_seed(seed)
    user = torch.randn((1, 3, USER_FEATURES), generator=draw)
    user[..., USER_AOI_COLUMN] = AGES_SLOTS / AOI_SCALE_SLOTS
    user[..., USER_SLOTS_COLUMN] = WAYS_SLOTS
    uav = torch.randn((1, 2, UAV_FEATURES), generator=draw)
    with torch.inference_mode():
        told = network(uav, user, torch.ones(1, 2), torch.ones(1, 3), torch.zeros(1, 2, 1, 2)).user_cost_slots[0]
    return torch.as_tensor(told)


def test_untaught_it_is_the_nearest_uav_coming_at_once() -> None:
    """1 + (1 - gamma^(n + 1/2)) (AoI - 1) + what time adds, by hand."""
    network = GcrlNetwork(ModelSpec(width=8, gamma=0.9))
    torch.nn.init.zeros_(network.value[-1].weight)
    waits = [(1.0 - 0.9 ** (n + IN_RANGE_SLOTS)) * (a - 1.0) for n, a in zip(WAYS_SLOTS, AGES_SLOTS, strict=True)]
    expected = [1.0 + float(wait) + ADDS_SCALE * math.log(2.0) for wait in waits]
    np.testing.assert_allclose(costs(network), expected, rtol=1e-5)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_whatever_is_learned_stays_near_it(seed: int) -> None:
    """However large the weights, a share's logit moves by ``MOST`` at most: the farther a user, the more it waits."""
    network = GcrlNetwork(ModelSpec(width=8, gamma=0.9))
    with torch.no_grad():
        network.value[-1].weight.mul_(1e4)
        network.adds.fill_(-30.0)  # time adds nothing to speak of
    shares = (costs(network, seed)[1:] - 1.0) / (AGES_SLOTS[1:] - 1.0)
    reached = 0.9 ** (WAYS_SLOTS[1:] + IN_RANGE_SLOTS)
    moved = torch.logit(shares) - torch.log((1.0 - reached) / reached)
    assert torch.all(moved.abs() <= MOST + 1e-3)
    assert torch.any(moved.abs() > 0.5 * MOST)


def test_the_column_of_ways_is_the_way_to_where_the_nearest_uav_could_serve() -> None:
    scenario = Scenario(Area((0.0, 0.0), (3000.0, 3000.0)), np.array([[0.0, 0.0]]), np.full(2, 0.02), slots=5)
    state = initial_state(scenario, np.array([[100.0, 0.0], [0.0, 1000.0]]))
    units = Units.of(scenario)
    told = make_features(stack_states([state], np.zeros((1, 2, STEPS, 2))), units).user[0, :, USER_SLOTS_COLUMN]
    np.testing.assert_allclose(told, [0.0, (1000.0 - scenario.serving_radius_m) / 270.0], rtol=1e-5)
