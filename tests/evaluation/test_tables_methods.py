"""Which networks are at hand, by what their cards say."""

import json
import shutil

import pytest

from policy.agents.registry import PLANNED, POLICIES
from policy.evaluation.tables.grid import QUICK_SLOTS, SECTIONS, Extent, make_grid
from policy.evaluation.tables.methods import Absent, Method, find_models, pick, registered
from policy.model.checkpoint import find_checkpoint
from policy.model.checkpoint_error import CheckpointError
from policy.model.files import sha256


@pytest.fixture
def trained(tmp_path):
    """A folder as training leaves it, whose card says what the test wants."""
    shipped = find_checkpoint(None)

    def make(name, **spec):
        folder = tmp_path / name
        folder.mkdir()
        shutil.copy(shipped.graph, folder / "model.onnx")
        card = json.loads(shipped.card.read_text())
        card["spec"].update(spec)
        (folder / "card.json").write_text(json.dumps(card))
        return folder

    return make


def test_the_shipped_network_comes_first_and_own_ones_after(trained, tmp_path):
    trained("b-square", similarity="square")
    trained("a-plain", use_rgcn=False)
    trained("c-gaussian")
    models = find_models(tmp_path)
    assert models[0].path is None
    assert models[0].sha256 == sha256(find_checkpoint(None).graph)
    assert [model.name for model in models[-3:]] == ["a-plain", "b-square", "c-gaussian"]
    assert pick(models) == models[0]
    assert pick(models, similarity="square").name == "b-square"
    assert pick(models, use_rgcn=False).kind == "gaussian, no RGCN"
    assert pick(models[:1], similarity="cosine") is None


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (lambda folder: (folder / "model.onnx").unlink(), "missing"),
        (lambda folder: (folder / "model.onnx").write_bytes(b"other"), "sha256"),
        (lambda folder: (folder / "card.json").write_text("{}"), "not a model card"),
    ],
)
def test_a_damaged_network_is_an_error_not_a_missing_row(trained, tmp_path, damage, complaint):
    damage(trained("mine"))
    with pytest.raises(CheckpointError, match=complaint):
        find_models(tmp_path)


def test_every_registered_method_has_a_row_and_those_to_come_say_so():
    rows = {row.name: row.method for row in registered(find_models(None))}
    assert set(POLICIES) <= set(rows)
    assert all(isinstance(rows[name], Method) for name in POLICIES)
    assert all(rows[name] == Absent("not in this version") for name in PLANNED if name not in POLICIES)


def test_without_any_network_gcrl_is_missing_with_a_reason():
    grid = make_grid(SECTIONS, ["x"], Extent(1), models=())
    assert all(isinstance(line.method, Absent) for line in grid.similarities)
    assert [row.name for row in grid.ablations if isinstance(row.method, Absent)] == [
        "gcrl", "w/o RGCN", "w/o pred", "w/o RGCN, pred",
    ]  # fmt: skip
    assert {point.method.policy for point in grid.points()} == {"random", "receding-horizon"}


def test_each_campaign_is_in_the_grid_once_and_the_paper_s_setting_in_every_campus():
    models = find_models(None)
    points = make_grid(SECTIONS, ["x", "y"], Extent(1), models).points()
    assert len(set(points)) == len(points)
    gcrl = Method("gcrl", None, models[0].sha256, models[0].kind)
    axes = {(point.uavs, point.mcl_db) for point in points if (point.method, point.campus) == (gcrl, "y")}
    assert axes == {(u, 117.0) for u in (2, 3, 5, 7, 9, 11)} | {(2, mcl) for mcl in (115.0, 117.0, 119.0, 121.0, 123.0)}


def test_a_choice_of_policies_leaves_the_others_out():
    grid = make_grid(SECTIONS, ["x"], Extent.quick(1), find_models(None), only=["random"])
    assert {point.method.policy for point in grid.points()} == {"random"}
    assert grid.extent.slots == QUICK_SLOTS
