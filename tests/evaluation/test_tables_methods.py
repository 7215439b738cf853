"""Which networks are at hand, by what their cards say."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import pytest
from fresh_rivals import fresh_learner

from policy.agents.registry import POLICIES, RIVALS
from policy.agents.rivals.checkpoint import CARD, WEIGHTS, save_learner
from policy.evaluation.tables.grid import QUICK_SLOTS, SECTIONS, Extent, make_grid
from policy.evaluation.tables.methods import Absent, Method, find_models, find_rivals, pick, registered
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
    assert pick(models, similarity="square").name == "gcrl-square"
    assert pick(models[-3:], similarity="square").name == "b-square"
    assert pick(models, use_rgcn=False).kind == "gaussian, no RGCN"
    assert pick(models[:1], similarity="cosine") is None
    assert all(model.curve for model in models[:-3])
    assert [model.curve for model in models[-3:]] == [None] * 3


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


def test_every_registered_method_has_a_row_and_rivals_without_a_network_say_so():
    rows = {row.name: row.method for row in registered(find_models(None))}
    assert set(POLICIES) <= set(rows)
    assert all(isinstance(rows[name], Method) for name in set(POLICIES) - RIVALS)
    assert all("no network of it trained there" in rows[name].reason for name in RIVALS)


def rival(folder, mission, seed):
    """A rival's network as training leaves it, untrained."""
    learner = fresh_learner("aoi-drqn", seed)
    save_learner(learner, folder / WEIGHTS)
    card = {
        "method": "aoi-drqn",
        "training": {"mission": mission, "seed": seed},
        "sha256": {"safetensors": sha256(folder / WEIGHTS)},
    }
    (folder / CARD).write_text(json.dumps(card))


def test_a_rival_flies_the_training_of_its_campus_and_seed(tmp_path):
    for mission, seed in [("here", 0), ("here", 1), ("there", 0)]:
        rival(tmp_path / f"{mission}{seed}", mission, seed)
    row = next(r for r in registered((), find_rivals(tmp_path)) if r.name == "aoi-drqn")
    here = row.on("here")
    assert [Path(here.for_seed(seed).checkpoint).parent.name for seed in range(3)] == ["here0", "here1", "here0"]
    assert Path(row.on("there").for_seed(1).checkpoint).parent.name == "there0"
    assert isinstance(row.on("elsewhere"), Absent)
    assert here.for_seed(0).document() != here.for_seed(1).document()
    assert here.for_seed(1).choice().build().name == "aoi-drqn"


def test_a_rivals_weights_that_differ_from_their_card_are_refused(tmp_path):
    rival(tmp_path / "one", "here", 0)
    (tmp_path / "one" / WEIGHTS).write_bytes(b"other")
    with pytest.raises(CheckpointError, match="sha256"):
        find_rivals(tmp_path)


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


def test_next_states_differ_in_nothing_else_and_the_learned_is_table_i_s():
    grid = make_grid(["nextstate"], ["x"], Extent(1), find_models(None))
    assert [row.name for row in grid.next_states] == ["exact", "hybrid", "learned", "printed"]
    options = [dict(row.on("x").options)["settings"] for row in grid.next_states]
    assert len({replace(settings, next_state="learned") for settings in options}) == 1
    assert grid.next_states[2].method in [line.method for line in grid.similarities]
    assert {point.method for point in grid.points()} == {row.method for row in grid.next_states}


def test_ablations_of_the_paper_s_search_leave_out_one_part_or_two():
    grid = make_grid(["table3"], ["x"], Extent(1), find_models(None))
    assert [row.name for row in grid.tree_ablations] == ["gcrl", "w/o RGCN", "w/o pred", "w/o RGCN, pred"]
    told = [row.on("x") for row in grid.tree_ablations]
    kinds = [dict(method.options)["settings"] for method in told]
    assert [settings.next_state for settings in kinds] == ["learned", "learned", "exact", "exact"]
    assert [method.network for method in told] == ["gaussian", "gaussian, no RGCN"] * 2
    assert {settings.tree.depth for settings in kinds} == {3}


def test_a_choice_of_policies_leaves_the_others_out():
    grid = make_grid(SECTIONS, ["x"], Extent.quick(1), find_models(None), only=["random"])
    assert {point.method.policy for point in grid.points()} == {"random"}
    assert grid.extent.slots == QUICK_SLOTS
