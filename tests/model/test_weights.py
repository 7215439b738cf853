import json
from pathlib import Path

import pytest
import torch
from safetensors.torch import save_file

from policy.model.checkpoint_error import CheckpointError
from policy.model.features import FEATURE_VERSION
from policy.model.network import GcrlNetwork
from policy.model.onnx_runner import SPEC_KEY
from policy.model.spec import ModelSpec
from policy.model.weights import load_weights, save_weights


def test_saved_and_loaded_are_the_same(tmp_path: Path) -> None:
    network = GcrlNetwork(ModelSpec(width=8))
    save_weights(network, tmp_path / "w.safetensors")
    loaded = load_weights(tmp_path / "w.safetensors", ModelSpec(width=8))
    for name, tensor in network.state_dict().items():
        assert torch.equal(tensor, loaded.state_dict()[name])


def test_another_shape_is_one_clear_line(tmp_path: Path) -> None:
    path = tmp_path / "w.safetensors"
    save_weights(GcrlNetwork(ModelSpec(width=8)), path)
    with pytest.raises(CheckpointError, match="asked for") as refusal:
        load_weights(path, ModelSpec(width=16))
    assert "\n" not in str(refusal.value)


def test_weights_that_do_not_fit_their_description_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "w.safetensors"
    save_file({"a": torch.zeros(2)}, path, {SPEC_KEY: json.dumps(ModelSpec(width=8).to_json())})
    with pytest.raises(CheckpointError, match="another shape") as refusal:
        load_weights(path)
    assert "\n" not in str(refusal.value)


def test_weights_that_read_other_features_are_refused(tmp_path: Path) -> None:
    """Of the same shape, they would mean something else."""
    path = tmp_path / "w.safetensors"
    network = GcrlNetwork(ModelSpec(width=8))
    older = network.spec.to_json() | {"feature_version": FEATURE_VERSION - 1}
    save_file(network.state_dict(), path, {SPEC_KEY: json.dumps(older)})
    with pytest.raises(CheckpointError, match=f"features of version {FEATURE_VERSION - 1}.*train it again") as refusal:
        load_weights(path)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("content", [None, b"", b"rubbish" * 100])
def test_missing_or_damaged_weights_are_one_clear_line(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "w.safetensors"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(CheckpointError) as refusal:
        load_weights(path)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)
