"""A rival's network on disk: ``checkpoint.safetensors`` with what is needed to build it, ``card.json`` beside it.

Weights are kept in half precision: a learned policy does not change by it, and 36 of them fit into one small archive.
"""

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from policy.agents.rivals.learner import Learner
from policy.model.checkpoint_error import CheckpointError
from policy.model.files import write_atomically

METHOD_KEY, SETTINGS_KEY = "method", "settings"
WEIGHTS, CARD = "checkpoint.safetensors", "card.json"


def save_learner(learner: Learner, path: Path) -> None:
    """All or nothing: an interrupted write leaves what was there before."""
    tensors = {name: value.detach().cpu().half().contiguous() for name, value in learner.network.state_dict().items()}
    told = {METHOD_KEY: learner.name, SETTINGS_KEY: json.dumps(learner.settings.to_json())}
    write_atomically(path, save(tensors, told))


def load_learner(kind: type[Learner], path: Path | str, device: str = "cpu") -> Learner:
    """The method as it was saved. ``path``: the file, or the folder that training wrote.

    Raises CheckpointError where it is missing, damaged, or another method's.
    """
    path = Path(path)
    file = path / WEIGHTS if path.is_dir() else path
    tensors, told = _read(file)
    if told.get(METHOD_KEY) != kind.name:
        whose = told.get(METHOD_KEY) or "no rival"
        raise CheckpointError(f'{file}: holds a network of {whose}, not of "{kind.name}"; name another')
    try:
        known = {field.name for field in fields(kind.settings_type)}
        saved = json.loads(told.get(SETTINGS_KEY, "{}"))
        settings = kind.settings_type(**{name: value for name, value in saved.items() if name in known})
        learner = kind(settings, device)
        learner.network.load_state_dict(tensors)
    except (RuntimeError, TypeError, ValueError) as error:
        line = " ".join(str(error).split())[:200]
        raise CheckpointError(f"{file}: weights of another shape ({line}); train again with this version") from None
    return learner


def method_of(path: Path) -> str | None:
    """Whose network a file holds; None where it is no rival's."""
    try:
        return _read(path)[1].get(METHOD_KEY)
    except CheckpointError:
        return None


def _read(file: Path) -> tuple[dict[str, Any], Mapping[str, str]]:
    if not file.is_file():
        raise CheckpointError(f"{file}: no such file; train one with `python -m policy train` or name another")
    try:
        with safe_open(file, framework="pt") as opened:
            return {name: opened.get_tensor(name) for name in opened.keys()}, opened.metadata() or {}  # noqa: SIM118
    except (SafetensorError, ValueError, OSError) as error:
        raise CheckpointError(f"{file}: not a checkpoint that can be read ({error}); copy it again") from None
