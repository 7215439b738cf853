"""Rivals with networks that have learned nothing, for tests of how they are kept and flown."""

import torch

from policy.agents.base import Agent
from policy.agents.registry import RIVALS, agent_type, make_agent
from policy.agents.rivals.learner import Learner


def fresh_learner(name: str, seed: int = 0) -> Learner:
    """The same weights for the same seed."""
    torch.manual_seed(seed)
    kind = agent_type(name).learner_type
    return kind(kind.settings_type())


def any_agent(name: str) -> Agent:
    """By name, whatever it needs to fly."""
    return agent_type(name)(learner=fresh_learner(name)) if name in RIVALS else make_agent(name)
