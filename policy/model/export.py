"""The network as an ONNX graph with batch, UAVs and users left open."""

import contextlib
import json
import logging
import warnings
from collections.abc import Iterator
from pathlib import Path

import onnx
import torch

from policy.model.evaluator import RawOutputs
from policy.model.features import UAV_ACTION_FEATURES, UAV_FEATURES, USER_FEATURES
from policy.model.files import write_atomically
from policy.model.network import GcrlNetwork
from policy.model.onnx_runner import INPUTS, SPEC_KEY

OPSET = 18


def export_onnx(network: GcrlNetwork, path: Path) -> None:
    """Write the graph with the network's description inside; weights are embedded (one file)."""
    with _quiet_exporter():
        graph = _graph(network)
    onnx.helper.set_model_props(graph, {SPEC_KEY: json.dumps(network.spec.to_json())})
    write_atomically(path, graph.SerializeToString())


def _graph(network: GcrlNetwork) -> onnx.ModelProto:
    batch, uavs, users = (torch.export.Dim(name, min=1) for name in ("batch", "uavs", "users"))
    axes = {
        "uav": {0: batch, 1: uavs},
        "user": {0: batch, 1: users},
        "uav_mask": {0: batch, 1: uavs},
        "user_mask": {0: batch, 1: users},
        "action": {0: batch, 1: uavs},
    }
    program = torch.onnx.export(
        network.eval(),
        _example(),
        input_names=list(INPUTS),
        output_names=list(RawOutputs._fields),
        dynamic_shapes=axes,
        opset_version=OPSET,
        dynamo=True,
        verbose=False,
    )
    assert program is not None
    return program.model_proto


@contextlib.contextmanager
def _quiet_exporter() -> Iterator[None]:
    """The exporter warns of its own deprecated parts, of axes that share a name, and of torchvision's absence."""
    registry = logging.getLogger("torch.onnx._internal.exporter._registration")
    level = registry.level
    registry.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        registry.setLevel(level)


def _example() -> tuple[torch.Tensor, ...]:
    batch, uavs, users = 3, 2, 5
    return (
        torch.zeros(batch, uavs, UAV_FEATURES),
        torch.zeros(batch, users, USER_FEATURES),
        torch.ones(batch, uavs),
        torch.ones(batch, users),
        torch.zeros(batch, uavs, UAV_ACTION_FEATURES),
    )
