"""The network as an ONNX graph with batch, UAVs, users and actions left open."""

import contextlib
import json
import logging
import warnings
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path

import onnx
import torch

from policy.model.evaluator import RawOutputs
from policy.model.features import UAV_ACTION_FEATURES, UAV_FEATURES, USER_FEATURES
from policy.model.files import write_atomically
from policy.model.network import GcrlNetwork
from policy.model.onnx_runner import INPUTS, SPEC_KEY
from policy.model.spec import ModelSpec

OPSET = 18


def export_onnx(network: GcrlNetwork, path: Path) -> None:
    """Write :func:`onnx_graph` to a file."""
    write_atomically(path, onnx_graph(network))


def onnx_graph(network: GcrlNetwork) -> bytes:
    """The graph with the network's weights and description inside."""
    graph = onnx.ModelProto.FromString(_template(network.spec))
    _fill(graph, network.state_dict())
    onnx.helper.set_model_props(graph, {SPEC_KEY: json.dumps(network.spec.to_json())})
    return bytes(graph.SerializeToString())


@lru_cache(maxsize=8)
def _template(spec: ModelSpec) -> bytes:
    """The graph of an untrained network: tracing takes many seconds, and weights do not change the graph."""
    with _quiet_exporter():
        return bytes(_graph(GcrlNetwork(spec)).SerializeToString())


def _fill(graph: onnx.ModelProto, weights: Mapping[str, torch.Tensor]) -> None:
    """Give every weight of the graph its value; RuntimeError for one that is not the network's own.

    The network may have some that the graph lacks: a similarity function that needs no weights leaves its own unused.
    """
    for initializer in graph.graph.initializer:
        name = initializer.name
        if name not in weights:
            raise RuntimeError(f"the exporter has folded weights into {name}, so the graph cannot be filled")
        initializer.CopyFrom(onnx.numpy_helper.from_array(weights[name].detach().cpu().numpy(), name))


def _graph(network: GcrlNetwork) -> onnx.ModelProto:
    batch, uavs, users, actions = (torch.export.Dim(name, min=1) for name in ("batch", "uavs", "users", "actions"))
    axes = {
        "uav": {0: batch, 1: uavs},
        "user": {0: batch, 1: users},
        "uav_mask": {0: batch, 1: uavs},
        "user_mask": {0: batch, 1: users},
        "action": {0: batch, 1: uavs, 2: actions},
    }
    program = torch.onnx.export(
        network.eval(),
        _example(),
        input_names=list(INPUTS),
        output_names=list(RawOutputs._fields),
        dynamic_shapes=axes,
        opset_version=OPSET,
        dynamo=True,
        optimize=False,  # weights keep their names; onnxruntime folds what can be folded when it loads the graph
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
    batch, uavs, users, actions = 3, 2, 5, 4
    return (
        torch.zeros(batch, uavs, UAV_FEATURES),
        torch.zeros(batch, users, USER_FEATURES),
        torch.ones(batch, uavs),
        torch.ones(batch, users),
        torch.zeros(batch, uavs, actions, UAV_ACTION_FEATURES),
    )
