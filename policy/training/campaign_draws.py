"""Batches of training campaigns: the sampler's episodes, each with another crowd, part of it, and start."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from policy.environments.vector_world import Campaigns
from policy.training.samplers import free_places
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario

Sampler = Callable[[np.random.Generator], tuple[Scenario, FloatArray]]


@dataclass(frozen=True)
class Variety:
    """How much the campaigns of a batch differ."""

    crowds: int = 8  # of the sampler's, among the campaigns of a batch
    least_users: float = 0.7  # share of the users that take part in a campaign, from this to all
    roam: float = 0.5  # share of campaigns that start anywhere instead of near the launch point


NO_VARIETY = Variety(crowds=1, least_users=1.0, roam=0.0)
"""Each campaign as the sampler gives it."""


def draw_campaigns(
    sampler: Sampler, rng: np.random.Generator, batch: int, variety: Variety, device: str = "cpu"
) -> Campaigns:
    """``batch`` campaigns on float32 tensors; the sampler's scenarios may differ in launch points only."""
    drawn = [sampler(rng) for _ in range(min(batch, variety.crowds))]
    scenario, places = drawn[0]
    users = places.shape[1]
    crowd = np.arange(batch) % len(drawn)
    launches = np.stack([_launch(drawn[int(number)][0], variety.roam, rng) for number in crowd])
    shares = rng.uniform(variety.least_users, 1.0, size=batch)
    order = rng.permuted(np.tile(np.arange(users), (batch, 1)), axis=1)
    active = order < np.maximum(1, np.ceil(shares * users))[:, None]
    return Campaigns(
        scenario,
        torch.as_tensor(launches, dtype=torch.float32, device=device),
        torch.as_tensor(np.stack([pos for _, pos in drawn]), dtype=torch.float32, device=device),
        torch.as_tensor(crowd, device=device),
        torch.as_tensor(active, device=device),
    )


def _launch(scenario: Scenario, roam: float, rng: np.random.Generator) -> FloatArray:
    if rng.random() < roam:
        return free_places(scenario, rng, tries=8)
    return np.asarray(scenario.launch_enu_m, dtype=np.float64)
