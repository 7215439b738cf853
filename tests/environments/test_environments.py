"""Other people's learners can use the world as it is: their own checkers say so, and one of them learns."""

import warnings

import numpy as np
import pytest
import torch
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test
from torch import nn

from policy.agents.base import Decision
from policy.environments.field import NUM_FEATURES
from policy.environments.gym_env import CrowdsensingEnv, vector_env
from policy.environments.parallel_env import CrowdsensingParallelEnv
from policy.evaluation.rollout import fly
from policy.training.collect import ArrayPlaces
from policy.world.scenario import Area, Scenario
from policy.world.state import JointAction

SLOTS, USERS = 10, 5


def sampler(rng):
    """Another crowd each time."""
    scenario = Scenario(Area((0.0, 0.0), (900.0, 700.0)), np.full((2, 2), 400.0), np.full(USERS, 0.02), slots=SLOTS)
    return scenario, np.tile(rng.uniform(0.0, 700.0, size=(USERS, 2)), (SLOTS + 1, 1, 1))


def test_gymnasiums_checker_is_content():
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*infinity.*|.*spec.*|.*render.*")
        check_env(CrowdsensingEnv(sampler), skip_render_check=True)


def test_pettingzoos_checker_is_content():
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*render.*|.*state.*")
        parallel_api_test(CrowdsensingParallelEnv(sampler), num_cycles=3 * SLOTS)


def test_the_same_seed_gives_the_same_campaign_and_the_metrics_at_its_end():
    seen = []
    for _ in range(2):
        env = CrowdsensingEnv(sampler)
        observation, info = env.reset(seed=4)
        rows = [observation]
        over = False
        while not over:
            observation, _, ended, over, info = env.step([2, 6])
            assert not ended
            rows.append(observation)
        seen.append((np.stack(rows), info["episodic_aoi"]))
    assert np.array_equal(seen[0][0], seen[1][0])
    assert seen[0][1] == seen[1][1] >= 1.0


def test_actions_of_another_shape_or_after_the_end_are_refused():
    env = CrowdsensingEnv(sampler)
    env.reset(seed=1)
    for wrong in ([0], [0, 9], [-1, 0]):
        with pytest.raises(ValueError, match="2 numbers from 0 to 8"):
            env.step(wrong)
    for _ in range(SLOTS):
        env.step([0, 0])
    with pytest.raises(RuntimeError, match="reset"):
        env.step([0, 0])


def test_the_environment_pays_what_the_evaluation_counts():
    class Hover:
        name = "hover"

        def reset(self, scenario, seed):
            pass

        def decide(self, state):
            return Decision(JointAction(np.zeros(2), np.zeros(2)))

    scenario, places = sampler(np.random.default_rng(8))
    record = fly(scenario, ArrayPlaces(places), Hover())
    env = CrowdsensingEnv(lambda _: (scenario, places))
    env.reset(seed=0)
    info = {}
    for _ in range(SLOTS):
        *_, info = env.step([0, 0])
    assert info["episodic_aoi"] == record.metrics.episodic_aoi
    assert info["energy_ratio"] == record.metrics.energy_ratio


def test_a_single_file_ppo_in_cleanrls_manner_trains_on_it():
    """Vector environment, rollout, advantages, clipped updates; nothing of this project but the environment."""
    torch.manual_seed(0)
    envs = vector_env(sampler, 4)
    uavs = envs.single_action_space.nvec.size
    actor = nn.Sequential(nn.Linear(NUM_FEATURES, 32), nn.Tanh(), nn.Linear(32, 9))
    critic = nn.Sequential(nn.Flatten(), nn.Linear(uavs * NUM_FEATURES, 32), nn.Tanh(), nn.Linear(32, 1))
    optimiser = torch.optim.Adam([*actor.parameters(), *critic.parameters()], lr=1e-3)
    before = [parameter.clone() for parameter in actor.parameters()]
    seen, _ = envs.reset(seed=1)
    for _ in range(2):
        rows = []
        for _ in range(12):  # longer than a campaign: the vector environment begins the next by itself
            now = torch.as_tensor(seen)
            policy = torch.distributions.Categorical(logits=actor(now))
            action = policy.sample()
            seen, reward, ended, cut, _ = envs.step(action.numpy())
            done = torch.as_tensor(ended | cut)
            row = (now, action, policy.log_prob(action).sum(-1), torch.as_tensor(reward).float(), done)
            rows.append(tuple(part.detach() for part in row))
        value_next, returns = critic(torch.as_tensor(seen))[:, 0].detach(), []
        for _, _, _, reward, done in reversed(rows):
            value_next = reward + 0.95 * value_next * ~done
            returns.append(value_next)
        target = torch.stack(returns[::-1])
        states, actions, old = (torch.stack([row[part] for row in rows]) for part in range(3))
        for _ in range(2):
            value = critic(states.flatten(0, 1))[:, 0].reshape(target.shape)
            advantage = (target - value).detach()
            ratio = (torch.distributions.Categorical(logits=actor(states)).log_prob(actions).sum(-1) - old).exp()
            surrogate = torch.minimum(ratio * advantage, ratio.clamp(0.8, 1.2) * advantage)
            loss = -surrogate.mean() + 0.5 * (value - target).square().mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            assert torch.isfinite(loss)
    assert any(not torch.equal(a, b) for a, b in zip(before, actor.parameters(), strict=True))
