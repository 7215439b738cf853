"""Flies a learned rival: the world's state becomes a batch of one, the network's choice a heading and a speed."""

from pathlib import Path
from typing import ClassVar

import numpy as np
import torch

from policy.agents.base import Decision
from policy.agents.rivals.checkpoint import load_learner
from policy.agents.rivals.learner import Learner
from policy.environments.vector_world import legal_actions
from policy.model.checkpoint_error import CheckpointError
from policy.world.actions import ActionSet, paper_actions
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState


class LearnedAgent:
    """One instance flies one campaign at a time. Each rival names its ``learner_type``."""

    name: str
    learner_type: ClassVar[type[Learner]]

    def __init__(self, checkpoint: Path | str | None = None, learner: Learner | None = None) -> None:
        """``checkpoint``: a file or a folder of `policy train`; ``learner``: one at hand. One of the two is needed."""
        if learner is None and checkpoint is None:
            raise CheckpointError(
                f'"{self.name}" comes without a trained network; train one (python -m policy train MISSION.toml '
                f"--policy {self.name} --out DIR) and name it with --checkpoint DIR"
            )
        self._learner = learner or load_learner(self.learner_type, checkpoint or "")
        self._scenario: Scenario
        self._actions: ActionSet

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Begin a campaign; ``seed`` makes what is drawn repeatable (muzero draws joint actions to look at)."""
        self._scenario, self._actions = scenario, paper_actions(scenario.max_speed_mps)
        self._seed = seed
        self._learner.begin(scenario, 1)

    def decide(self, state: WorldState) -> Decision:
        """The network's choice among the legal moves."""
        batch = tensor_state(state)
        with torch.random.fork_rng(devices=[]), torch.inference_mode():
            torch.manual_seed(self._seed * 100_003 + state.slot)
            chosen = self._learner.choose(batch, legal_actions(self._scenario, batch))[0].cpu().numpy()
        joint = JointAction(self._actions.heading_rad[chosen], self._actions.speed_mps[chosen])
        return Decision(joint, explanation={"actions": [int(action) for action in chosen]})


def tensor_state(state: WorldState) -> WorldState:
    """A state without batch as tensors with a batch of one."""

    def floats(values: FloatArray) -> torch.Tensor:
        return torch.as_tensor(np.asarray(values), dtype=torch.float32)[None]

    return WorldState(
        slot=state.slot,
        uav_pos_enu_m=floats(state.uav_pos_enu_m),
        uav_vel_enu_mps=floats(state.uav_vel_enu_mps),
        uav_energy_j=floats(state.uav_energy_j),
        uav_active=torch.as_tensor(np.asarray(state.uav_active))[None],
        user_pos_enu_m=floats(state.user_pos_enu_m),
        user_data_mb=floats(state.user_data_mb),
        user_aoi_slots=floats(state.user_aoi_slots),
        user_active=torch.as_tensor(np.asarray(state.user_active))[None],
    )
