"""A fleet from one launch point does not fly as one UAV."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from tiny_campaign import tiny_places, tiny_scenario

from policy.agents.registry import RIVALS, agent_type
from policy.agents.rivals.apart import best_apart
from policy.agents.rivals.learner import best_legal
from policy.evaluation.rollout import fly
from policy.training.collect import ArrayPlaces


def test_by_hand_three_at_one_place_take_its_three_best_actions_and_one_elsewhere_its_best():
    values = torch.tensor([0.1, 0.9, 0.5, 0.7, 0.0, 0.0, 0.0, 0.0, 0.0]).expand(1, 4, 9)
    legal = torch.ones((1, 4, 9), dtype=torch.bool)
    legal[0, 2, 2] = False
    place_m = torch.tensor([[[50.0, 50.0], [900.0, 50.0], [50.0, 50.4], [50.0, 50.0]]])
    assert best_apart(values, legal, place_m).tolist() == [[1, 1, 3, 2]]


def test_one_for_which_nothing_is_left_takes_its_best():
    values = torch.rand((2, 11, 9), generator=torch.Generator().manual_seed(1))
    legal = torch.ones((2, 11, 9), dtype=torch.bool)
    actions = best_apart(values, legal, torch.zeros((2, 11, 2)))
    for campaign in range(2):
        assert sorted(actions[campaign, :9].tolist()) == list(range(9))
    assert torch.equal(actions[:, 9:], best_legal(values, legal)[:, 9:])


def test_alone_at_its_place_each_takes_its_best_legal_action():
    draw = torch.Generator().manual_seed(2)
    values, place_m = torch.rand((16, 5, 9), generator=draw), 1e3 * torch.rand((16, 5, 2), generator=draw)
    legal = torch.rand((16, 5, 9), generator=draw) < 0.7
    legal[..., 0] = True
    assert torch.equal(best_apart(values, legal, place_m), best_legal(values, legal))


@pytest.mark.parametrize("name", sorted(RIVALS))
def test_uavs_that_start_together_part(name):
    scenario, places = replace(tiny_scenario(), slots=12).with_uavs(3), tiny_places()[:13]
    torch.manual_seed(1)
    kind = agent_type(name).learner_type
    agent = agent_type(name)(learner=kind(kind.settings_type(hidden=16)))
    states = fly(scenario, ArrayPlaces(places), agent, seed=3).states
    assert np.ptp(scenario.launch_enu_m, axis=0).max() == 0.0
    spread_m = [np.ptp(state.uav_pos_enu_m, axis=0).max() for state in states[1:]]
    assert np.mean(np.asarray(spread_m) > 1.0) > 0.5
