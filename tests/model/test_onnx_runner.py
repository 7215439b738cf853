"""The exported graph against the torch module: the two that the evaluator protocol holds interchangeable."""

from pathlib import Path

import numpy as np
import onnx
import pytest
import torch
from tests_model_states import random_features, random_states, small_units

from policy.model.checkpoint_error import CheckpointError
from policy.model.evaluator import NetworkEvaluator
from policy.model.export import export_onnx
from policy.model.network import GcrlNetwork
from policy.model.onnx_runner import SPEC_KEY, OnnxRunner
from policy.model.spec import SIMILARITIES, ModelSpec
from policy.model.torch_runner import TorchRunner

SIZES = [(1, 1, 1), (1, 2, 59), (5, 3, 33), (2, 11, 92)]


@pytest.fixture(scope="module")
def graphs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[GcrlNetwork, Path]]:
    made = {}
    for similarity in SIMILARITIES:
        torch.manual_seed(7)
        network = GcrlNetwork(ModelSpec(similarity=similarity))
        path = tmp_path_factory.mktemp("graphs") / f"{similarity}.onnx"
        export_onnx(network, path)
        made[similarity] = (network, path)
    return made


@pytest.mark.parametrize("similarity", SIMILARITIES)
def test_both_answer_alike_for_any_number_of_uavs_and_users(
    graphs: dict[str, tuple[GcrlNetwork, Path]], similarity: str
) -> None:
    network, path = graphs[similarity]
    exported, trained = OnnxRunner(path), TorchRunner(network)
    rng = np.random.default_rng(0)
    for batch, uavs, users in SIZES:
        features = random_features(rng, batch, uavs, users)
        action = rng.uniform(-1.0, 1.0, (batch, uavs, int(rng.integers(1, 5)), 2)).astype(np.float32)
        for ours, theirs in zip(exported.run(features, action), trained.run(features, action), strict=True):
            np.testing.assert_allclose(ours, theirs, rtol=1e-4, atol=1e-4)


def test_a_graph_is_traced_once_and_has_each_networks_own_weights(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    features, action = random_features(rng, 1, 2, 7), np.zeros((1, 2, 1, 2), np.float32)
    answers = []
    for seed in (1, 2):
        torch.manual_seed(seed)
        network = GcrlNetwork(ModelSpec())
        export_onnx(network, tmp_path / f"{seed}.onnx")
        answers.append(OnnxRunner(tmp_path / f"{seed}.onnx").run(features, action).user_cost_slots)
        np.testing.assert_allclose(answers[-1], TorchRunner(network).run(features, action).user_cost_slots, rtol=1e-4)
    assert not np.allclose(answers[0], answers[1])


def test_both_evaluators_agree_in_real_units(graphs: dict[str, tuple[GcrlNetwork, Path]]) -> None:
    network, path = graphs["gaussian"]
    exported, trained = NetworkEvaluator(OnnxRunner(path)), NetworkEvaluator(TorchRunner(network))
    states, units = random_states(np.random.default_rng(2), batch=4, uavs=2, users=12), small_units(12)
    np.testing.assert_allclose(exported.value(states, units), trained.value(states, units), rtol=1e-4)
    np.testing.assert_allclose(exported.predict_users(states, units), trained.predict_users(states, units), atol=1e-2)
    np.testing.assert_allclose(exported.relations(states, units), trained.relations(states, units), atol=1e-4)


def test_the_graph_says_which_network_it_is(graphs: dict[str, tuple[GcrlNetwork, Path]]) -> None:
    assert OnnxRunner(graphs["cosine"][1]).spec == ModelSpec(similarity="cosine")


def test_what_cannot_be_run_is_one_clear_line(graphs: dict[str, tuple[GcrlNetwork, Path]], tmp_path: Path) -> None:
    missing, rubbish, cut = tmp_path / "none.onnx", tmp_path / "rubbish.onnx", tmp_path / "cut.onnx"
    rubbish.write_bytes(b"not a graph at all")
    cut.write_bytes(graphs["gaussian"][1].read_bytes()[:5000])
    for path in (missing, rubbish, cut):
        with pytest.raises(CheckpointError) as refusal:
            OnnxRunner(path)
        assert str(path) in str(refusal.value)
        assert "\n" not in str(refusal.value)


def test_another_networks_graph_is_refused(graphs: dict[str, tuple[GcrlNetwork, Path]], tmp_path: Path) -> None:
    graph = onnx.load_model(graphs["gaussian"][1])
    onnx.helper.set_model_props(graph, {SPEC_KEY: '{"width": 32}'})
    path = tmp_path / "other.onnx"
    onnx.save_model(graph, path)
    with pytest.raises(CheckpointError, match="keys"):
        OnnxRunner(path)
    graph.graph.input[0].type.tensor_type.shape.dim[2].dim_value = 99
    onnx.helper.set_model_props(graph, {SPEC_KEY: '{"a": 1}'})
    onnx.save_model(graph, path)
    with pytest.raises(CheckpointError):
        OnnxRunner(path)
