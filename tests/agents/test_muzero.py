"""MuZero's targets by hand, and where their values come from: the network as it is now."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from tiny_campaign import tiny_places, tiny_scenario

from policy.agents.muzero import Muzero, MuzeroSettings, value_targets, visited_policy
from policy.agents.rivals.tree import Found
from policy.environments.vector_world import VectorWorld
from policy.training.campaign_draws import NO_VARIETY, draw_campaigns

SETTINGS = MuzeroSettings(
    hidden=16, warmup_slots=10, batch_size=6, unroll=2, n_step=3, simulations=4, width=4, reanalysed=6
)


def flown(slots=9, batch=3):
    """A learner that remembers one batch of campaigns."""
    torch.manual_seed(0)
    scenario = replace(tiny_scenario(), slots=slots)
    campaigns = draw_campaigns(
        lambda _: (scenario, tiny_places()[: slots + 1]), np.random.default_rng(0), batch, NO_VARIETY
    )
    learner, world = Muzero(SETTINGS), VectorWorld(campaigns)
    learner.begin(world.scenario, batch)
    while not world.done:
        learner.remember(world.step(learner.choose(world.state, world.legal(), 1.0)), last=world.done)
    return learner


def test_value_targets_equal_a_calculation_by_hand():
    reward = torch.tensor([[1.0, 1.0], [2.0, 2.0], [4.0, 4.0], [8.0, 8.0]])  # R + n = 2 + 2 slots, two windows
    ahead = torch.tensor([[True, True], [True, True], [True, False], [True, False]])  # the second ends after a slot
    value = torch.tensor([[100.0, 10.0], [200.0, 20.0]])
    found = value_targets(reward, value, ahead, 0.5)
    assert found[0].tolist() == [1.0 + 0.5 * 2.0 + 0.25 * 100.0, 1.0 + 0.5 * 10.0]
    assert found[1].tolist() == [2.0 + 0.5 * 4.0 + 0.25 * 200.0, 20.0]


def test_values_that_targets_end_in_are_those_of_the_network_as_it_is_now():
    learner = flown()
    window = learner._replay.draw(6, SETTINGS.unroll + SETTINGS.n_step)
    last = learner.network.value[-1]
    with torch.no_grad():
        last.weight.zero_()
        last.bias.fill_(3.5)
    assert learner._values_ahead(window).tolist() == [[3.5] * 6] * (SETTINGS.unroll + 1)


def test_reanalysing_writes_the_policies_of_the_windows_that_are_learned_from():
    learner = flown()
    window = learner._replay.draw(6, SETTINGS.unroll + SETTINGS.n_step)
    learner._replay.put("policy", window, 0, torch.zeros(6, 1, 9))
    learner._reanalyse(window)
    policy = learner._replay.gather("policy", window, slice(0, 1))[0]
    assert torch.allclose(policy.sum(-1), torch.ones(6, 1), atol=1e-2)


@pytest.mark.parametrize("every", [1, 3])
def test_reanalysis_comes_before_every_so_many_updates(every, monkeypatch):
    learner = flown()
    learner.settings = replace(SETTINGS, reanalyse_every=every)
    searched = []
    monkeypatch.setattr(learner, "_reanalyse", lambda _: searched.append(learner._updates))
    for _ in range(6):
        assert learner.learn() is not None
    assert searched == list(range(0, 6, every))


def test_a_uavs_visits_count_whatever_the_others_did():
    actions = torch.tensor([[[0, 5], [0, 6], [3, 5]]])
    found = Found(actions, torch.tensor([[2.0, 1.0, 1.0]]), torch.zeros(1), torch.zeros(1, 3))
    first, second = visited_policy(found)[0]
    assert first[[0, 3]].tolist() == [0.75, 0.25]
    assert second[[5, 6]].tolist() == [0.75, 0.25]


def test_the_learned_model_predicts_rewards_of_remembered_slots_better_after_learning():
    learner = flown(slots=12, batch=8)
    losses = [learner.learn() for _ in range(60)]
    assert np.mean(losses[-10:]) < 0.9 * np.mean(losses[:10])
