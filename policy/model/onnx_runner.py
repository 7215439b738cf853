"""The exported network run by onnxruntime: what the base install flies with."""

import json
from pathlib import Path

import onnxruntime

from policy.model.checkpoint_error import CheckpointError
from policy.model.evaluator import RawOutputs
from policy.model.features import UAV_FEATURES, USER_FEATURES, Features, Float32Array
from policy.model.spec import ModelSpec

INPUTS = ("uav", "user", "uav_mask", "user_mask", "action")
SPEC_KEY = "gcrl_spec"

# What onnxruntime raises for a file that is no graph, or none that it can run; they share no base class but Exception.
_REFUSALS = tuple(
    getattr(onnxruntime.capi.onnxruntime_pybind11_state, name)
    for name in ("Fail", "InvalidArgument", "InvalidGraph", "InvalidProtobuf", "NoSuchFile", "NotImplemented")
)


class OnnxRunner:
    """One session on one thread: a decision must not take the cores that the links need."""

    def __init__(self, graph: Path | bytes) -> None:
        """From a file or what would be in it; CheckpointError with one line unless it is a graph of this version."""
        name = "this graph" if isinstance(graph, bytes) else str(graph)
        self._session = _open(graph, name)
        self.spec = _read_spec(self._session, name)
        _check_inputs(self._session, name)

    def run(self, features: Features, action: Float32Array) -> RawOutputs:
        """Features and actions [B, U, A, 2] -> heads."""
        arrays = (features.uav, features.user, features.uav_mask, features.user_mask, action)
        return RawOutputs(*self._session.run(RawOutputs._fields, dict(zip(INPUTS, arrays, strict=True))))


def _open(graph: Path | bytes, name: str) -> onnxruntime.InferenceSession:
    if isinstance(graph, Path) and not graph.is_file():
        raise CheckpointError(f"{name}: no such file; train one with `python -m policy train` or name another")
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.log_severity_level = 4  # refusals are told by the exception below, once
    try:
        source = graph if isinstance(graph, bytes) else name
        return onnxruntime.InferenceSession(source, options, providers=["CPUExecutionProvider"])
    except _REFUSALS as refusal:
        raise CheckpointError(
            f"{name}: not a network that can be run ({_first_line(refusal)}); export it again"
        ) from None


def _read_spec(session: onnxruntime.InferenceSession, name: str) -> ModelSpec:
    text = session.get_modelmeta().custom_metadata_map.get(SPEC_KEY)
    if text is None:
        raise CheckpointError(f"{name}: the graph does not say which network it is ({SPEC_KEY}); export it again")
    try:
        return ModelSpec.from_json(json.loads(text))
    except (ValueError, AttributeError, TypeError) as error:
        raise CheckpointError(f"{name}: {_first_line(error)}; train it again with this version") from None


def _check_inputs(session: onnxruntime.InferenceSession, name: str) -> None:
    widths = {node.name: node.shape[-1] for node in session.get_inputs()}
    if set(widths) != set(INPUTS) or (widths["uav"], widths["user"]) != (UAV_FEATURES, USER_FEATURES):
        raise CheckpointError(
            f"{name}: takes {widths.get('uav')} numbers a UAV and {widths.get('user')} a user, this version gives "
            f"{UAV_FEATURES} and {USER_FEATURES}; train again or use the checkpoint of that version"
        )


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0][:160] if str(error) else type(error).__name__
