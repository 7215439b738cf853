"""A run's whole state in one file, so that what goes on after an interruption ends in the same weights.

Randomness needs no saving: every episode draws from generators seeded by the run's seed and its own number.
"""

import io
from dataclasses import asdict
from pathlib import Path

import torch

from policy.model.files import write_atomically
from policy.training.learner import Learner
from policy.training.replay import Episode, Replay
from policy.training.settings import TrainingError, TrainSettings, check_same

FILE = "training_state.pt"
MAY_DIFFER = ("device", "threads", "checkpoint_every")
"""Settings that do not change what is learned."""


def save_snapshot(path: Path, settings: TrainSettings, learner: Learner, replay: Replay, scores: list[float]) -> None:
    """Written beside and renamed: the file is the old one or the new one."""
    episodes = [{k: torch.from_numpy(v) for k, v in asdict(episode).items()} for episode in replay.episodes]
    content = {"settings": settings.to_json(), "learner": learner.state(), "scores": scores, "episodes": episodes}
    buffer = io.BytesIO()
    torch.save(content, buffer)
    try:
        write_atomically(path, buffer.getbuffer())
    except OSError as error:
        raise TrainingError(f"{path}: cannot write the checkpoint ({error}); the last good one is kept") from None


def load_snapshot(path: Path, settings: TrainSettings, learner: Learner, replay: Replay) -> list[float]:
    """Fill ``learner`` and ``replay``; the scores so far. TrainingError where the file does not fit the run."""
    if not path.is_file():
        raise TrainingError(f"{path}: nothing to resume; start without --resume")
    try:
        content = torch.load(path, map_location=settings.device, weights_only=True)
        check_same(path, content["settings"], settings.to_json(), MAY_DIFFER)
        learner.restore(content["learner"])
        for episode in content["episodes"]:
            replay.add(Episode(**{name: tensor.cpu().numpy() for name, tensor in episode.items()}))
        return [float(score) for score in content["scores"]]
    except (RuntimeError, KeyError, TypeError, EOFError, OSError) as error:
        if isinstance(error, TrainingError):
            raise
        line = " ".join(str(error).split())[:160]
        raise TrainingError(f"{path}: cannot be resumed from ({line}); start without --resume") from None
