"""A campaign as a PettingZoo parallel environment: every UAV is an agent of its own, all are paid alike.

Agents are ``uav_0`` ... ``uav_{U-1}``. Each observes [NUM_FEATURES] float32, its own row of what
:class:`~policy.environments.gym_env.CrowdsensingEnv` shows, chooses one of nine actions and receives the team's
reward of Eq. 8. All are truncated together after the last slot. Comes with the ``environments`` extra.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from pettingzoo import ParallelEnv

from policy.environments.field import NUM_FEATURES
from policy.environments.gym_env import Sampler
from policy.environments.single_world import SingleWorld

Observation = npt.NDArray[np.float32]


class CrowdsensingParallelEnv(ParallelEnv[str, Observation, int]):  # type: ignore[misc]
    """One campaign an episode, drawn by ``sampler(rng)``: a scenario and its users' places [T+1, M, 2]."""

    metadata = {"name": "uav_crowdsensing_v0", "render_modes": []}  # noqa: RUF012 - PettingZoo's own spelling

    def __init__(self, sampler: Sampler) -> None:
        """The fleet's size must not change from episode to episode; everything else may."""
        self._sampler = sampler
        scenario, _ = sampler(np.random.default_rng(0))
        self.render_mode = None
        self.possible_agents = [f"uav_{number}" for number in range(scenario.num_uavs)]
        self.agents: list[str] = []
        sight = spaces.Box(-np.inf, np.inf, (NUM_FEATURES,), np.float32)
        self.observation_spaces = dict.fromkeys(self.possible_agents, sight)
        self.action_spaces = {agent: spaces.Discrete(9) for agent in self.possible_agents}
        self._rng = np.random.default_rng()
        self._world: SingleWorld

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The same for each."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The paper's nine."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Begin the next campaign."""
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        self._world = SingleWorld(*self._sampler(self._rng))
        self.agents = list(self.possible_agents)
        return self._observations(), self._infos()

    def step(
        self, actions: dict[str, int]
    ) -> tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Fly a slot."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        earned = self._world.step([actions[agent] for agent in self.possible_agents])
        over = self._world.done
        answer = (
            self._observations(),
            dict.fromkeys(self.agents, earned),
            dict.fromkeys(self.agents, False),
            dict.fromkeys(self.agents, over),
            self._infos(),
        )
        if over:
            self.agents = []
        return answer

    def _observations(self) -> dict[str, Observation]:
        return dict(zip(self.possible_agents, self._world.observe(), strict=True))

    def _infos(self) -> dict[str, dict[str, Any]]:
        legal = self._world.legal()
        return {agent: {"legal": row} for agent, row in zip(self.possible_agents, legal, strict=True)}
