"""Checkpoints on disk: weights (safetensors), exported graph (ONNX) and model card (JSON), found and checked.

A trained folder holds ``checkpoint.safetensors``, ``model.onnx`` and ``card.json``; the shipped default lies under
its own names in ``policy/checkpoints``. Flying needs the graph and its card, training the weights.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from policy.model.checkpoint_error import CheckpointError
from policy.model.evaluator import NetworkEvaluator
from policy.model.files import SHIPPED, check_digest
from policy.model.forecast_file import DEFAULT_FORECAST, FORECAST_NAME, load_forecaster
from policy.model.onnx_runner import OnnxRunner

DEFAULT_NAME = "gcrl-default"


@dataclass(frozen=True)
class CheckpointFiles:
    """Where the three parts lie."""

    weights: Path
    graph: Path
    card: Path

    @classmethod
    def in_folder(cls, folder: Path) -> "CheckpointFiles":
        """The names that training writes."""
        return cls(folder / "checkpoint.safetensors", folder / "model.onnx", folder / "card.json")

    @classmethod
    def named(cls, stem: Path) -> "CheckpointFiles":
        """``STEM.safetensors``, ``STEM.onnx``, ``STEM.json``."""
        return cls(*(stem.with_name(stem.name + suffix) for suffix in (".safetensors", ".onnx", ".json")))


def find_checkpoint(path: Path | str | None) -> CheckpointFiles:
    """A folder that training wrote, any of its files, a stem, or ``None`` for the shipped default."""
    if path is None:
        return CheckpointFiles.named(SHIPPED / DEFAULT_NAME)
    path = Path(path)
    if path.is_dir():
        return CheckpointFiles.in_folder(path)
    in_folder = CheckpointFiles.in_folder(path.parent)
    if path in (in_folder.weights, in_folder.graph, in_folder.card):
        return in_folder
    stem = path.with_suffix("") if path.suffix in (".safetensors", ".onnx", ".json") else path
    if not path.exists() and not CheckpointFiles.named(stem).graph.exists():
        raise CheckpointError(f"{path}: no such checkpoint; name a folder that `python -m policy train` wrote")
    return CheckpointFiles.named(stem)


def read_card(files: CheckpointFiles) -> Mapping[str, Any]:
    """The model card: where the weights come from."""
    try:
        card = json.loads(files.card.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise CheckpointError(f"{files.card}: the checkpoint's model card is missing; copy it along") from None
    except (ValueError, OSError) as error:
        raise CheckpointError(f"{files.card}: not a model card ({error}); copy it again") from None
    if not isinstance(card, dict) or not isinstance(card.get("sha256"), dict):
        raise CheckpointError(f"{files.card}: not a model card (no sha256 of its files); copy it again")
    return card


def load_evaluator(path: Path | str | None = None, forecast: Path | None = None) -> NetworkEvaluator:
    """The exported network behind a checkpoint, checked against its card; CheckpointError otherwise.

    With it comes the forecast of users' places: ``forecast``, else the folder's own ``forecast.safetensors``, else the
    shipped one.
    """
    files = find_checkpoint(path)
    runner = OnnxRunner(files.graph)
    check_digest(files.graph, read_card(files)["sha256"].get("onnx"))
    own = files.graph.with_name(FORECAST_NAME)
    return NetworkEvaluator(runner, load_forecaster(forecast or (own if own.is_file() else DEFAULT_FORECAST)))
