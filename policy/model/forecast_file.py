"""A trained forecast on disk: weights (safetensors) and model card (JSON), found and checked. Needs no torch."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from safetensors import SafetensorError, safe_open

from policy.model.checkpoint_error import CheckpointError
from policy.model.features import Float32Array
from policy.model.files import SHIPPED, check_digest
from policy.model.forecast import FORECAST_SLOTS, Forecaster
from policy.model.forecast_features import FORECAST_FEATURES

DEFAULT_FORECAST = SHIPPED / "forecast-default.safetensors"
FORECAST_NAME = "forecast.safetensors"
"""In a trained folder, beside the checkpoint that it belongs to."""
SHAPES = {
    "mean": (FORECAST_FEATURES,),
    "deviation": (FORECAST_FEATURES,),
    "first.weight": (-1, FORECAST_FEATURES),
    "first.bias": (-1,),
    "second.weight": (-1, -1),
    "second.bias": (-1,),
    "out.weight": (3 * FORECAST_SLOTS, -1),
    "out.bias": (3 * FORECAST_SLOTS,),
}
"""Arrays of the file; -1 is the width."""


def load_forecaster(path: Path | str | None = None) -> Forecaster:
    """From ``NAME.safetensors`` with its card ``NAME.json`` beside it; None: the shipped one. CheckpointError if not
    usable.
    """
    path = DEFAULT_FORECAST if path is None else Path(path)
    if not path.is_file():
        raise CheckpointError(f"{path}: no such forecast; train one with `python -m policy.training.forecast`")
    try:
        with safe_open(path, framework="np") as file:
            weights = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - no mapping
    except (SafetensorError, OSError) as error:
        raise CheckpointError(f"{path}: not a forecast that can be read ({error}); copy it again") from None
    _check_shapes(path, weights)
    check_digest(path, _card(path.with_suffix(".json")).get("sha256"))
    return Forecaster(weights)


def _check_shapes(path: Path, weights: Mapping[str, Float32Array]) -> None:
    found = {name: array.shape for name, array in weights.items()}
    width = found.get("first.bias", (0,))[0]
    wanted = {name: tuple(width if n < 0 else n for n in shape) for name, shape in SHAPES.items()}
    if found != wanted:
        raise CheckpointError(f"{path}: holds arrays {found} instead of {wanted}; train again with this version")


def _card(path: Path) -> Mapping[str, Any]:
    try:
        card = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, OSError) as error:
        raise CheckpointError(f"{path}: the forecast's model card cannot be read ({error}); copy it along") from None
    if not isinstance(card, dict):
        raise CheckpointError(f"{path}: not a model card; copy it again")
    return card
