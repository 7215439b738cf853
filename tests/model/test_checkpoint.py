import json
import shutil
from pathlib import Path

import pytest

from policy.model.checkpoint import CheckpointFiles, find_checkpoint, load_evaluator, read_card
from policy.model.checkpoint_error import CheckpointError
from policy.model.files import SHIPPED, sha256


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The shipped checkpoint under the names that training writes."""
    shipped, copy = find_checkpoint(None), CheckpointFiles.in_folder(tmp_path / "trained")
    copy.card.parent.mkdir()
    for source, target in ((shipped.weights, copy.weights), (shipped.graph, copy.graph), (shipped.card, copy.card)):
        shutil.copy(source, target)
    return tmp_path / "trained"


def test_the_shipped_checkpoint_is_whole() -> None:
    files = find_checkpoint(None)
    card = read_card(files)
    assert files.graph.parent == SHIPPED
    assert card["sha256"] == {"onnx": sha256(files.graph), "safetensors": sha256(files.weights)}
    assert load_evaluator().spec.to_json() == card["spec"]
    for key in ("data", "seeds", "objective", "git_commit", "command", "versions", "date_utc", "training_s", "limits"):
        assert card[key], f"the model card does not tell {key}"


def test_a_folder_and_any_of_its_files_name_one_checkpoint(folder: Path) -> None:
    expected = CheckpointFiles.in_folder(folder)
    for path in (folder, folder / "checkpoint.safetensors", folder / "model.onnx", folder / "card.json"):
        assert find_checkpoint(path) == expected
    assert load_evaluator(str(folder)).spec == load_evaluator().spec


def test_a_stem_and_its_files_name_one_checkpoint() -> None:
    for suffix in ("", ".onnx", ".safetensors", ".json"):
        assert find_checkpoint(SHIPPED / f"gcrl-default{suffix}") == find_checkpoint(None)


def damage(folder: Path, kind: str) -> None:
    files = CheckpointFiles.in_folder(folder)
    match kind:
        case "no graph":
            files.graph.unlink()
        case "no card":
            files.card.unlink()
        case "card cut off":
            files.card.write_text(files.card.read_text()[:50])
        case "card is a list":
            files.card.write_text("[1, 2]")
        case "card of another":
            card = json.loads(files.card.read_text())
            files.card.write_text(json.dumps({**card, "sha256": {"onnx": "0" * 64}}))
        case "graph cut off":
            files.graph.write_bytes(files.graph.read_bytes()[:-1000])


@pytest.mark.parametrize(
    "kind", ["no graph", "no card", "card cut off", "card is a list", "card of another", "graph cut off"]
)
def test_damage_is_one_clear_line(folder: Path, kind: str) -> None:
    damage(folder, kind)
    with pytest.raises(CheckpointError) as refusal:
        load_evaluator(folder)
    assert str(folder) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_name_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(CheckpointError, match="no such checkpoint"):
        load_evaluator(tmp_path / "nowhere")
