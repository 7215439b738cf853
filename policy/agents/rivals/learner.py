"""What a rival is to the training loop and to the agent that flies it.

Joint actions of nine for each UAV would be 9^U; every rival here factors them. One network, the same for all UAVs,
looks from each UAV's own place and answers for its nine actions; what the team is paid is the sum (values) or the
product (policies) of these answers, so that one network flies any number of UAVs.
"""

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass, fields
from typing import Any, ClassVar

import torch
from torch import Tensor, nn

from policy.environments.field import AOI_UNIT
from policy.world.scenario import Scenario
from policy.world.state import WorldState

NUM_ACTIONS = 9
"""Hovering and eight headings at full speed."""


@dataclass(frozen=True)
class LearnerSettings:
    """What every rival has; each adds its own. ValueError for what cannot be learned with."""

    campaigns: int = 64  # flown at once
    learning_rate: float = 5e-4
    batch_size: int = 64
    gamma: float = 0.95  # the paper's
    n_step: int = 3
    replay_slots: int = 60_000  # campaign slots remembered, all campaigns together
    warmup_slots: int = 4_000  # remembered before the first update
    updates_per_slot: float = 1.0  # updates for each slot that the batch of campaigns flies
    target_every: int = 200  # updates between copies into the target network
    explore_start: float = 1.0  # share of actions drawn at random, falling linearly ...
    explore_end: float = 0.05
    explore_share: float = 0.4  # ... within this share of the training

    may_be_zero: ClassVar[frozenset[str]] = frozenset({"warmup_slots", "explore_start", "explore_end", "explore_share"})
    shares: ClassVar[frozenset[str]] = frozenset({"gamma", "explore_start", "explore_end", "explore_share"})

    def __post_init__(self) -> None:
        """Every number is positive, but for those named above: these may be 0, or are at most 1."""
        for name in (field.name for field in fields(self)):
            value, zero_ok = getattr(self, name), name in self.may_be_zero
            if value < 0 or (value == 0 and not zero_ok):
                raise ValueError(f"{name} must be {'0 or more' if zero_ok else 'positive'}, not {value}")
            if name in self.shares and value > 1:
                raise ValueError(f"{name} is a share and must be at most 1, not {value}")

    def to_json(self) -> dict[str, Any]:
        """For the checkpoint and its card."""
        return asdict(self)

    def exploration(self, progress: float) -> float:
        """Share of random actions when ``progress`` in [0, 1] of the training is done."""
        done = min(1.0, progress / self.explore_share) if self.explore_share > 0.0 else 1.0
        return self.explore_start + (self.explore_end - self.explore_start) * done


class Learner(ABC):
    """A method with its network. The same object learns and flies; flying asks ``choose`` only."""

    name: ClassVar[str]
    settings_type: ClassVar[type[LearnerSettings]]

    network: nn.Module  # all that a checkpoint keeps

    def __init__(self, settings: LearnerSettings, device: str = "cpu") -> None:
        self.settings = settings
        self.device = torch.device(device)

    @abstractmethod
    def begin(self, scenario: Scenario, batch: int) -> None:
        """Before slot 0 of ``batch`` campaigns that fly in step."""

    @abstractmethod
    def choose(self, state: WorldState, legal: Tensor, explore: float | None = None) -> Tensor:
        """Actions [B, U] for batched tensors; ``legal`` bool [B, U, 9]. ``explore``: None flies as well as it can."""

    @abstractmethod
    def remember(self, reward: Tensor, *, last: bool) -> None:
        """Rewards [B] of the slot that the latest exploring ``choose`` decided; ``last`` of the campaigns."""

    @abstractmethod
    def learn(self) -> float | None:
        """One update: its loss, or None while there is too little to learn from."""

    @abstractmethod
    def optimiser_state(self) -> dict[str, Any]:
        """What a resumed training needs beside the network."""

    @abstractmethod
    def restore_optimiser(self, state: dict[str, Any]) -> None:
        """As :meth:`optimiser_state` gave it."""


def reward_scale(scenario: Scenario) -> float:
    """Rewards of Eq. 8 times this are in the units of the features: five slots of mean AoI are one."""
    return AOI_UNIT / max(scenario.objective.c_aoi, scenario.objective.c_collect, 1e-9)


def best_legal(values: Tensor, legal: Tensor) -> Tensor:
    """The best action of each UAV among the legal ones: [..., 9], bool [..., 9] -> [...]."""
    return values.masked_fill(~legal, -torch.inf).argmax(-1)


def explore_legal(actions: Tensor, legal: Tensor, share: float) -> Tensor:
    """``actions`` [B, U] with a ``share`` of them drawn anew, each legal action as likely."""
    if share <= 0.0:
        return actions
    drawn = torch.multinomial(legal.reshape(-1, legal.shape[-1]).float(), 1).reshape(actions.shape)
    return torch.where(torch.rand(actions.shape, device=actions.device) < share, drawn, actions)
