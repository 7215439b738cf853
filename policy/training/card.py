"""The model card: where weights come from, what they were trained for, and how far to trust them."""

import importlib.metadata
import json
import platform
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from policy.model.checkpoint import CheckpointFiles
from policy.model.features import UAV_FEATURES, USER_FEATURES
from policy.model.files import sha256, write_atomically
from policy.model.network import GcrlNetwork
from policy.training.settings import TrainSettings
from policy.world.scenario import Objective

LIMITS = (
    "The value was learned under the flights of the paper's own search and is meant as the leaf of such a search.",
    "Learned for the objective below; another weight of coverage or energy changes what the best policy is.",
)


def write_card(
    files: CheckpointFiles,
    *,
    network: GcrlNetwork,
    settings: TrainSettings,
    objective: Objective,
    data: str,
    scores: list[float],
    training_s: float,
    commit: str | None,
) -> None:
    """Write ``files.card`` for the weights and the graph that lie beside it."""
    card: Mapping[str, Any] = {
        **card_head("GCRL-min(AoI)", commit),
        "spec": network.spec.to_json(),
        "shapes": {"uav_features": UAV_FEATURES, "user_features": USER_FEATURES},
        "parameters": sum(p.numel() for p in network.parameters()),
        "data": data,
        "objective": vars(objective),
        "settings": settings.to_json(),
        "seeds": [settings.seed],
        "episodes": len(scores),
        "episodic_aoi_last_20": sum(scores[-20:]) / max(1, len(scores[-20:])),
        "training_s": round(training_s, 1),
        "sha256": {"safetensors": sha256(files.weights), "onnx": sha256(files.graph)},
        "limits": list(LIMITS),
    }
    write_atomically(files.card, (json.dumps(card, indent=2) + "\n").encode())


def card_head(method: str, commit: str | None = None) -> dict[str, Any]:
    """What every card tells: when, by which command, from which sources (None: those that lie here now)."""
    return {
        "method": method,
        "date_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": command_line(sys.orig_argv),
        "git_commit": commit or git_commit(),
        "versions": {name: importlib.metadata.version(name) for name in ("torch", "numpy", "onnx", "onnxruntime")},
        "python": platform.python_version(),
    }


def command_line(arguments: Sequence[str]) -> str:
    """As typed, with the last names of absolute paths: a card tells no machine's folders."""
    named = [Path(word).name if Path(word).is_absolute() else word for word in arguments[1:]]
    return shlex.join(["python", *named])


def git_commit() -> str | None:
    """Of the sources that ran; None outside a clone."""
    try:
        answer = subprocess.run(
            ["git", "rev-parse", "HEAD"],  # noqa: S607 - whichever git the user has
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            check=True,
            timeout=10,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return answer.stdout.strip()
