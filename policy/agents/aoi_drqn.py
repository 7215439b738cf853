"""AoI-aware DRQN: a recurrent Q-network over the sequence of what each UAV observes.

After the paper's [41] and [42] (Hausknecht and Stone, 2015): a GRU between the observation and the Q-values of the
nine actions, learned from sequences of a replay. With what has since become usual: the double estimator, n-step
returns, a dueling head, and the memory of the sequence's start kept beside it and run in before it counts
(Kapturowski et al., R2D2, 2019). The team's value is the sum of its UAVs' (Sunehag et al., VDN, 2018).
"""

from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional

from policy.agents.rivals.agent import LearnedAgent
from policy.agents.rivals.apart import best_apart
from policy.agents.rivals.learner import (
    NUM_ACTIONS,
    LearnerSettings,
    best_legal,
    explore_legal,
    reward_scale,
)
from policy.agents.rivals.replay import Replay, n_step
from policy.agents.rivals.value_learner import ValueLearner
from policy.environments.field import NUM_FEATURES, features
from policy.world.scenario import Scenario
from policy.world.state import WorldState


@dataclass(frozen=True)
class DrqnSettings(LearnerSettings):
    """The sequence: ``burn_in`` slots to warm the memory, then ``sequence`` that are learned from."""

    hidden: int = 128
    burn_in: int = 4
    sequence: int = 8
    batch_size: int = 48
    updates_per_slot: float = 0.5

    may_be_zero: ClassVar[frozenset[str]] = LearnerSettings.may_be_zero | {"burn_in"}


class DrqnNetwork(nn.Module):
    """Observations [N, NUM_FEATURES] and memory [N, H] -> Q [N, 9] and the memory after them."""

    def __init__(self, hidden: int) -> None:
        super().__init__()
        self.see = nn.Linear(NUM_FEATURES, hidden)
        self.recall = nn.GRUCell(hidden, hidden)
        self.think = nn.Linear(2 * hidden, hidden)
        self.value, self.advantage = nn.Linear(hidden, 1), nn.Linear(hidden, NUM_ACTIONS)

    def forward(self, seen: Tensor, memory: Tensor) -> tuple[Tensor, Tensor]:
        """One slot."""
        seen = functional.relu(self.see(seen))
        memory = self.recall(seen, memory)
        thought = functional.relu(self.think(torch.cat((seen, memory), -1)))
        advantage = self.advantage(thought)
        return self.value(thought) + advantage - advantage.mean(-1, keepdim=True), memory


class Drqn(ValueLearner):
    """Learns from windows of ``burn_in + sequence + n_step`` slots."""

    name = "aoi-drqn"
    settings_type = DrqnSettings
    settings: DrqnSettings

    def __init__(self, settings: DrqnSettings, device: str = "cpu") -> None:
        super().__init__(DrqnNetwork(settings.hidden), settings, device)
        self._replay = Replay(settings.replay_slots)

    def begin(self, scenario: Scenario, batch: int) -> None:
        """Empty memories."""
        self._scenario, self._scale = scenario, reward_scale(scenario)
        self._memory = torch.zeros((batch, scenario.num_uavs, self.settings.hidden), device=self.device)

    @torch.no_grad()
    def choose(self, state: WorldState, legal: Tensor, explore: float | None = None) -> Tensor:
        """Greedy, or with a share of random actions."""
        seen = features(self._scenario, state)
        q, memory = self.network(seen.flatten(0, 1), self._memory.flatten(0, 1))
        actions = best_apart(q.reshape(legal.shape), legal, state.uav_pos_enu_m)
        if explore is not None:
            actions = explore_legal(actions, legal, explore)
            self._seen = {"seen": seen, "memory": self._memory, "legal": legal, "actions": actions}
        self._memory = memory.reshape(self._memory.shape)
        return actions

    def remember(self, reward: Tensor, *, last: bool) -> None:
        """Keep the slot."""
        self._replay.add({**self._seen, "reward": reward * self._scale}, last=last)

    def learn(self) -> float | None:
        """One step of Adam on a batch of sequences."""
        if len(self._replay) < self.settings.warmup_slots:
            return None
        return self._descend(self._loss())

    def _loss(self) -> Tensor:
        settings, replay = self.settings, self._replay
        span = settings.burn_in + settings.sequence + settings.n_step
        window = replay.draw(settings.batch_size, span)
        seen, legal = replay.gather("seen", window), replay.gather("legal", window)
        actions, reward = replay.gather("actions", window), replay.gather("reward", window)
        memory = replay.gather("memory", window, slice(0, 1))[0]
        q = self._run(self.network, seen, memory, settings.burn_in)
        with torch.no_grad():
            q_target = self._run(self._target, seen, memory, span)
            best = best_legal(q, legal)
            ahead_value = q_target.gather(-1, best[..., None])[..., 0].sum(-1)  # [K+1, N], of the team
        team = q.gather(-1, actions[..., None])[..., 0].sum(-1)
        losses = []
        for begin in range(settings.burn_in, settings.burn_in + settings.sequence):
            rest = slice(begin, begin + settings.n_step + 1)
            returns, discount, row = n_step(reward[rest], window.ahead[rest], settings.gamma, settings.n_step)
            value = ahead_value[rest].gather(0, row[None].clamp(min=0))[0]
            counts = row > 0
            error = functional.huber_loss(team[begin], returns + discount * value, reduction="none")
            losses.append((error * counts).sum() / counts.sum().clamp(min=1))
        return torch.stack(losses).mean()

    def _run(self, network: nn.Module, seen: Tensor, memory: Tensor, silent: int) -> Tensor:
        """Q [K+1, N, U, 9] along the sequence; the first ``silent`` slots only move the memory on."""
        answers = []
        shape = seen.shape[1:3]
        memory = memory.flatten(0, 1)
        for slot in range(seen.shape[0]):
            with torch.set_grad_enabled(slot >= silent and torch.is_grad_enabled()):
                q, memory = network(seen[slot].flatten(0, 1), memory)
            answers.append(q.reshape(*shape, NUM_ACTIONS))
        return torch.stack(answers)


class AoiDrqnAgent(LearnedAgent):
    """Flies a trained :class:`Drqn`."""

    name = "aoi-drqn"
    learner_type = Drqn
