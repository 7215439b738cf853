"""Weights of a network to and from safetensors, with its description beside them."""

import json
from pathlib import Path

from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from policy.model.checkpoint_error import CheckpointError
from policy.model.files import write_atomically
from policy.model.network import GcrlNetwork
from policy.model.onnx_runner import SPEC_KEY
from policy.model.spec import ModelSpec


def save_weights(network: GcrlNetwork, path: Path) -> None:
    """All or nothing: an interrupted write leaves what was there before."""
    tensors = {name: tensor.detach().cpu().contiguous() for name, tensor in network.state_dict().items()}
    write_atomically(path, save(tensors, {SPEC_KEY: json.dumps(network.spec.to_json())}))


def load_weights(path: Path, expected: ModelSpec | None = None) -> GcrlNetwork:
    """The network as saved; CheckpointError if missing, damaged or (with ``expected``) of another shape."""
    if not path.is_file():
        raise CheckpointError(f"{path}: no such file; train one with `python -m policy train` or name another")
    try:
        with safe_open(path, framework="pt") as file:
            spec = ModelSpec.from_json(json.loads((file.metadata() or {}).get(SPEC_KEY, "{}")))
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - no mapping
    except (SafetensorError, OSError) as error:
        raise CheckpointError(f"{path}: not a checkpoint that can be read ({error}); copy it again") from None
    except ValueError as error:
        raise CheckpointError(f"{path}: {error}; train it again with this version") from None
    if expected is not None and spec != expected:
        raise CheckpointError(f"{path}: holds {spec}, asked for is {expected}; train again or change the settings")
    return _fill(GcrlNetwork(spec), tensors, path)


def _fill(network: GcrlNetwork, tensors: dict[str, object], path: Path) -> GcrlNetwork:
    try:
        network.load_state_dict(tensors)
    except RuntimeError as error:
        line = " ".join(str(error).split())[:200]
        raise CheckpointError(f"{path}: weights of another shape ({line}); train again with this version") from None
    return network
