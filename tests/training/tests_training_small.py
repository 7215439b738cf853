"""Campaigns and runs small enough for tests."""

import math
from dataclasses import replace

import numpy as np

from policy.model.features import USER_FEATURES
from policy.model.spec import ModelSpec
from policy.training.replay import Episode
from policy.training.samplers import AnyPlace
from policy.training.settings import TrainSettings
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario

SMALL_PLACE = AnyPlace(slots=6, users=(4, 7), uavs=(1, 2), side_m=(1000.0, 1200.0), accel_mps2=(math.inf,))

SMALL_RUN = TrainSettings(
    episodes=4,
    seed=5,
    model=ModelSpec(width=8, layers=1),
    batch_size=8,
    updates_per_episode=2,
    n_step=3,
    target_every=3,
    replay_episodes=3,
    warmup_episodes=1,
    horizon_slots=2,
    beam=3,
    checkpoint_every=2,
)


def small_scenario() -> Scenario:
    return SMALL_PLACE(np.random.default_rng(0))[0]


def made_episode(slots: int, uavs: int, users: int, seed: int = 0) -> Episode:
    """Numbers that tell where they come from: AoI of user m after slot t is 10 t + m."""
    rng = np.random.default_rng(seed)

    def drawn(*shape: int) -> np.ndarray:
        return rng.normal(size=shape).astype(np.float32)

    aoi = (10.0 * np.arange(slots + 1)[:, None] + np.arange(users)).astype(np.float32)
    return Episode(
        uav=drawn(slots + 1, uavs, 8),
        user=drawn(slots + 1, users, USER_FEATURES),
        uav_mask=np.ones((slots + 1, uavs), dtype=np.float32),
        user_mask=np.ones((slots + 1, users), dtype=np.float32),
        aoi_slots=aoi,
        action=drawn(slots, uavs, 2),
        uav_next=drawn(slots, uavs, 3),
    )


class Poisoned:
    """Draws good campaigns, then batteries of which any share is not a number."""

    def __init__(self, good: int) -> None:
        self.left = good

    def __call__(self, rng: np.random.Generator) -> tuple[Scenario, FloatArray]:
        scenario, pos_enu_m = SMALL_PLACE(rng)
        self.left -= 1
        return (scenario if self.left >= 0 else replace(scenario, battery_j=math.inf)), pos_enu_m
