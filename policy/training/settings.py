"""What a training run is told, what it tells, and how it fails."""

from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from policy.model.spec import ModelSpec
from policy.search.paper_tree import DEEPEST


class TrainingError(RuntimeError):
    """A run that cannot go on: one line that says what is wrong, where, and what was kept."""


class TrainingStoppedError(TrainingError):
    """Asked to stop: the checkpoint holds everything up to the episode that was flown last."""


@dataclass(frozen=True)
class TrainSettings:
    """Defaults: the paper's (Section VII-A) where it names one; ours are said to be."""

    episodes: int = 500
    seed: int = 0
    device: str = "cpu"
    model: ModelSpec = field(default_factory=ModelSpec)
    learning_rate: float = 1e-3
    final_learning_rate_share: float = 0.1  # ours: falls linearly to this share over the run
    batch_size: int = 128
    updates_per_episode: int = 8  # ours: Algorithm 1 updates in every slot, on one sample
    n_step: int = 10  # ours: rewards summed before the target network's value (Eq. 16 has one)
    target_every: int = 100  # updates between copies into the target network
    replay_episodes: int = 300
    explore_start: float = 0.15  # share of slots flown at random, falling linearly ...
    explore_end: float = 0.05
    search_depth: int = 1  # N of Eq. 13 while training; each more costs three to six times as much
    warmup_episodes: int = 10  # ours: flown by the plain planner, before the network is worth asking ...
    horizon_slots: int = 6  # ... this far ahead ...
    beam: int = 12  # ... and this wide
    checkpoint_every: int = 50  # episodes
    threads: int = 1
    physics: str = "ideal"  # a name for the card: which physics the episodes were flown in

    def __post_init__(self) -> None:
        """Refuse what cannot be run."""
        counts = (
            "episodes batch_size updates_per_episode n_step target_every replay_episodes search_depth horizon_slots"
            " beam checkpoint_every threads"
        )
        for name in counts.split():
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, not {getattr(self, name)}")
        if self.search_depth > DEEPEST:
            raise ValueError(f"search_depth must be from 1 to {DEEPEST}, not {self.search_depth}")
        if not 0.0 <= self.explore_end <= self.explore_start <= 1.0:
            raise ValueError("exploration must fall within [0, 1]: 0 <= explore_end <= explore_start <= 1")
        if not self.learning_rate > 0.0 or not 0.0 < self.final_learning_rate_share <= 1.0:
            raise ValueError("learning_rate must be positive and final_learning_rate_share within (0, 1]")
        if self.seed < 0 or self.warmup_episodes < 0:
            raise ValueError("seed and warmup_episodes must not be negative")

    def shortened(self) -> "TrainSettings":
        """The same for a run that is short for the usual warm-up: half of its episodes at most."""
        return replace(self, warmup_episodes=min(self.warmup_episodes, self.episodes // 2))

    def to_json(self) -> dict[str, Any]:
        """For the model card."""
        return asdict(self)

    def exploration(self, episode: int) -> float:
        """Share of random slots in ``episode`` (0 is the first)."""
        return self.explore_start + (self.explore_end - self.explore_start) * self._progress(episode)

    def rate(self, episode: int) -> float:
        """Learning rate in ``episode``."""
        return self.learning_rate * (1.0 + (self.final_learning_rate_share - 1.0) * self._progress(episode))

    def _progress(self, episode: int) -> float:
        return min(1.0, episode / max(1, self.episodes - 1))


@dataclass(frozen=True)
class TrainProgress:
    """Told after every episode."""

    episode: int  # flown so far
    episodes: int  # in all
    score: float  # episodic AoI of this episode, exploration included (Eq. 7)
    mean_score: float  # over the last 20 episodes
    value_loss: float  # Eq. 16; NaN before the first update
    prediction_loss: float  # Eq. 15
    eta_s: float  # seconds left, by the pace so far


def check_same(
    path: Path, saved: Mapping[str, Any], wanted: Mapping[str, Any], may_differ: Collection[str] = ()
) -> None:
    """Raise TrainingError where a run that is to go on from ``path`` was begun with other settings."""
    different = [k for k in wanted if k not in may_differ and saved.get(k) != wanted[k]]
    if different:
        told = ", ".join(f"{k} {saved.get(k)} instead of {wanted[k]}" for k in different)
        raise TrainingError(f"{path}: was trained with {told}; resume with the same settings or start anew")
