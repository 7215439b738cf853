"""A campaign as a gymnasium environment: one learner that moves the whole fleet.

Observation [U, NUM_FEATURES] float32: what each UAV sees (``policy/environments/field.py``), the same for any number
of users. Action MultiDiscrete: one of the nine for each UAV. Reward: Eq. 8. A campaign ends by truncation after its
last slot, and never early; ``info["legal"]`` bool [U, 9] says which actions stay inside and clear of obstacles, and an
action that does not is flown as hovering. Comes with the ``environments`` extra.
"""

from collections.abc import Callable
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from policy.environments.field import NUM_FEATURES
from policy.environments.single_world import SingleWorld
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario

Observation = npt.NDArray[np.float32]
Sampler = Callable[[np.random.Generator], tuple[Scenario, FloatArray]]


class CrowdsensingEnv(gymnasium.Env[Observation, npt.NDArray[np.int64]]):
    """One campaign an episode, drawn by ``sampler(rng)``: a scenario and its users' places [T+1, M, 2]."""

    metadata = {"render_modes": []}  # noqa: RUF012 - gymnasium's own spelling

    def __init__(self, sampler: Sampler) -> None:
        """The fleet's size must not change from episode to episode; everything else may."""
        self._sampler = sampler
        scenario, _ = sampler(np.random.default_rng(0))
        self._uavs = scenario.num_uavs
        self.observation_space = spaces.Box(-np.inf, np.inf, (self._uavs, NUM_FEATURES), np.float32)
        self.action_space = spaces.MultiDiscrete(np.full(self._uavs, 9))
        self._world: SingleWorld

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin the next campaign."""
        super().reset(seed=seed)
        self._world = SingleWorld(*self._sampler(self.np_random))
        return self._world.observe(), self._info()

    def step(self, action: npt.NDArray[np.int64]) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Fly a slot."""
        reward = self._world.step(action)
        return self._world.observe(), reward, False, self._world.done, self._info()

    def _info(self) -> dict[str, Any]:
        info: dict[str, Any] = {"legal": self._world.legal(), "slot": self._world.state.slot}
        return {**info, **self._world.metrics()} if self._world.done else info


def vector_env(sampler: Sampler, count: int) -> gymnasium.vector.SyncVectorEnv:
    """``count`` campaigns side by side, as CleanRL and others take them."""
    return gymnasium.vector.SyncVectorEnv([lambda: CrowdsensingEnv(sampler) for _ in range(count)])
