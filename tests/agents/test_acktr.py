"""ACKTR's advantages by hand, and the sign of its gradient: what is rewarded becomes likelier."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from tiny_campaign import tiny_places, tiny_scenario

from policy.agents.acktr import Acktr, AcktrSettings
from policy.environments.vector_world import VectorWorld
from policy.training.campaign_draws import NO_VARIETY, draw_campaigns


def world(batch, slots):
    scenario = replace(tiny_scenario(), slots=slots)
    rng = np.random.default_rng(0)
    return VectorWorld(draw_campaigns(lambda _: (scenario, tiny_places()[: slots + 1]), rng, batch, NO_VARIETY))


def test_returns_and_advantages_equal_a_calculation_by_hand():
    learner = Acktr(AcktrSettings(gamma=0.5, trace=0.5, hidden=4))
    learner._rollout.value = [torch.tensor([1.0, 0.0]), torch.tensor([2.0, 0.0]), torch.tensor([4.0, 0.0])]
    learner._rollout.reward = [torch.tensor([3.0, 0.0]), torch.tensor([5.0, 4.0]), torch.tensor([7.0, 7.0])]
    returns, advantage = learner._advantages()
    # First campaign: errors 3 + 1 - 1 = 3 and 5 + 2 - 2 = 5, so 3 + 0.25 * 5 = 4.25 and 5.
    # Second: errors 0 and 4, so 1 and 4. The last slot's reward belongs to the next rollout.
    assert returns.tolist() == [5.25, 1.0, 7.0, 4.0]
    against_all = torch.tensor([1.625, -1.625, 0.5, -0.5])  # each slot's mean over campaigns taken off
    assert torch.allclose(advantage, against_all / against_all.std(), atol=1e-4)


def test_what_is_rewarded_becomes_likelier():
    torch.manual_seed(0)
    learner = Acktr(AcktrSettings(hidden=16, rollout=5, trust=5e-3))
    east = 3  # the third of eight headings clockwise from north; hovering is 0
    shares = []
    for _ in range(8):
        flown = world(16, 11)
        learner.begin(flown.scenario, 16)
        chosen = []
        while not flown.done:
            actions = learner.choose(flown.state, flown.legal(), 0.0)
            flown.step(actions)
            learner.remember(10.0 * (actions == east).float().sum(-1), last=flown.done)
            learner.learn()
            chosen.append(actions)
        shares.append(float((torch.stack(chosen) == east).float().mean()))
    assert shares[-1] > 1.3 * shares[0]


def test_an_update_moves_the_policy_by_about_its_trust_region():
    torch.manual_seed(0)
    learner = Acktr(AcktrSettings(hidden=16, rollout=8, trust=1e-3))
    flown = world(16, 9)
    learner.begin(flown.scenario, 16)
    states = []
    while not flown.done:
        states.append((flown.state, flown.legal()))
        learner.remember(flown.step(learner.choose(*states[-1], 1.0)), last=flown.done)
    rollout = learner._rollout
    joined = [torch.cat(values[:-1]) for values in (rollout.nodes, rollout.links, rollout.ages, rollout.own)]
    legal = torch.cat(rollout.legal[:-1])
    before = learner.network(*joined)[0].masked_fill(~legal, -1e9).detach()
    assert learner.learn() is not None
    after = learner.network(*joined)[0].masked_fill(~legal, -1e9).detach()
    kl = torch.distributions.kl_divergence(*(torch.distributions.Categorical(logits=x) for x in (before, after)))
    assert 0.0 < float(kl.sum(-1).mean()) < 3e-3


def test_it_flies_as_it_was_trained_by_drawing_and_repeats_itself_under_a_seed():
    torch.manual_seed(0)
    learner, flown = Acktr(AcktrSettings(hidden=8)), world(64, 3)
    learner.begin(flown.scenario, 64)
    legal = flown.legal()
    drawn = []
    for _ in range(2):
        torch.manual_seed(7)
        drawn.append(learner.choose(flown.state, legal))
    assert torch.equal(*drawn)
    assert len(drawn[0].unique()) == int(legal[0].sum())  # an untrained policy is even over what is legal


def lead(learner):
    bias = learner.network.actor.bias.detach()
    return float(bias[3] - bias[1])


@pytest.mark.parametrize("explore", [0.0, 1.0])
def test_the_entropys_weight_falls_with_the_exploration(explore):
    """Without advantages only the entropy moves the policy: a sharp one becomes flatter, or stays as it is."""
    torch.manual_seed(0)
    learner = Acktr(AcktrSettings(hidden=8, rollout=4, entropy=1.0, trust=1e-2))
    with torch.no_grad():
        learner.network.actor.bias[3] = 3.0
    before = lead(learner)
    for _ in range(4):
        flown = world(8, 5)
        learner.begin(flown.scenario, 8)
        while not flown.done:
            actions = learner.choose(flown.state, flown.legal(), explore)
            flown.step(actions)
            learner.remember(torch.zeros(8), last=flown.done)
        learner._rollout.value = [torch.zeros(8) for _ in learner._rollout.value]  # no advantage at all
        learner.learn()
    after = lead(learner)
    if explore:
        assert after < before - 0.02
    else:
        assert after == pytest.approx(before, abs=0.02)
