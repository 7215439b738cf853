"""The model card of a trained rival: what it was trained on, how, for how long, and how far to trust it."""

import importlib.metadata
import json
import platform
import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from policy.agents.rivals.learner import Learner
from policy.model.files import sha256, write_atomically
from policy.training.card import command_line, git_commit
from policy.training.rival_settings import RivalTraining

LIMITS = (
    "A rival for comparison, trained on one mission's users; it knows nothing of other places.",
    "Its nine actions are the paper's; it has never flown under an acceleration limit unless the mission gave one.",
)


def write_rival_card(
    path: Path,
    *,
    weights: Path,
    learner: Learner,
    settings: RivalTraining,
    data: str,
    episodes: int,
    updates: int,
    tests: Sequence[tuple[int, float]],
    training_s: float,
    processor_s: float,
) -> None:
    """Write ``path`` for the network that lies beside it."""
    card = {
        "method": learner.name,
        "settings": learner.settings.to_json(),
        "training": settings.to_json(),
        "parameters": sum(p.numel() for p in learner.network.parameters()),
        "data": data,
        "seeds": [settings.seed],
        "episodes": episodes,
        "updates": updates,
        "tests": [{"episodes": episode, "episodic_aoi": round(score, 4)} for episode, score in tests],
        "training_s": round(training_s, 1),
        "processor_s": round(processor_s, 1),
        "date_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": command_line(sys.orig_argv),
        "git_commit": git_commit(),
        "versions": {name: importlib.metadata.version(name) for name in ("torch", "numpy")},
        "python": platform.python_version(),
        "device": settings.device,
        "sha256": {"safetensors": sha256(weights)},
        "limits": list(LIMITS),
    }
    write_atomically(path, (json.dumps(card, indent=2) + "\n").encode())
