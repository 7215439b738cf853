"""What holds of every rival, trained or not: shapes, seeds, number of UAVs, checkpoints, errors."""

import builtins
import json
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch
from tiny_campaign import tiny_places, tiny_sampler, tiny_scenario

from policy.agents.registry import RIVALS, UnknownPolicyError, agent_type, make_agent
from policy.agents.rivals.checkpoint import WEIGHTS, load_learner, save_learner
from policy.environments.vector_world import VectorWorld
from policy.evaluation.rollout import fly
from policy.model.checkpoint_error import CheckpointError
from policy.training.campaign_draws import NO_VARIETY, draw_campaigns
from policy.training.collect import ArrayPlaces
from policy.training.rival_settings import RivalTraining
from policy.training.rivals import train_rival
from policy.training.settings import TrainingError

QUICK = {"warmup_slots": 20, "batch_size": 8, "hidden": 16}
NAMES = sorted(RIVALS)


def learner(name, **changes):
    torch.manual_seed(1)
    kind = agent_type(name).learner_type
    return kind(kind.settings_type(**{**QUICK, **changes}))


def short(slots=6, uavs=1):
    scenario = replace(tiny_scenario(), slots=slots).with_uavs(uavs)
    return scenario, tiny_places()[: slots + 1]


@pytest.mark.parametrize("uavs", [1, 2, 11])
@pytest.mark.parametrize("name", NAMES)
def test_one_network_flies_any_number_of_uavs_inside_the_area(name, uavs):
    scenario, places = short(uavs=uavs)
    record = fly(scenario, ArrayPlaces(places), agent_type(name)(learner=learner(name)), seed=3)
    assert np.stack(record.heading_rad).shape == (6, uavs)
    assert record.violations["geofence"] == 0


@pytest.mark.parametrize("name", NAMES)
def test_training_leaves_a_network_that_flies_the_same_from_disk(name, tmp_path):
    scenario, places = short()
    trained = learner(name)
    settings = RivalTraining(episodes=12, batch=4, tests=3, test_campaigns=2, variety=NO_VARIETY)
    told = []
    train_rival(trained, lambda _: (scenario, places), settings, tmp_path, progress=told.append)
    assert [t.episode for t in told] == [4, 8, 12]
    assert told[-1].best <= min(t.tested for t in told)
    first, again = (
        fly(scenario, ArrayPlaces(places), make_agent(name, checkpoint=str(tmp_path)), seed=5) for _ in range(2)
    )
    assert np.array_equal(np.stack(first.heading_rad), np.stack(again.heading_rad))
    assert f'"method": "{name}"' in (tmp_path / "card.json").read_text()


@pytest.mark.parametrize("name", NAMES)
def test_learning_changes_the_network(name, tmp_path):
    scenario, places = short()
    trained = learner(name)
    before = {key: value.clone() for key, value in trained.network.state_dict().items()}
    settings = RivalTraining(episodes=24, batch=4, tests=1, test_campaigns=1, variety=NO_VARIETY)
    train_rival(trained, lambda _: (scenario, places), settings, tmp_path)
    after = trained.network.state_dict()
    assert any(not torch.equal(before[key], after[key]) for key in before)
    assert all(torch.isfinite(value).all() for value in after.values())


@pytest.mark.parametrize("name", NAMES)
def test_a_training_that_was_interrupted_goes_on_where_it_was(name, tmp_path):
    scenario, places = short()
    half = RivalTraining(episodes=8, batch=4, tests=2, test_campaigns=1, variety=NO_VARIETY)
    train_rival(learner(name), lambda _: (scenario, places), half, tmp_path)
    spent_s = json.loads((tmp_path / "card.json").read_text())["processor_s"]
    told = []
    whole = replace(half, episodes=16, tests=4)
    resumed = learner(name)
    train_rival(resumed, lambda _: (scenario, places), whole, tmp_path, resume=True, progress=told.append)
    assert [t.episode for t in told] == [12, 16]
    assert json.loads((tmp_path / "card.json").read_text())["processor_s"] > spent_s > 0.0


def test_nothing_to_resume_and_another_methods_state_are_one_line(tmp_path):
    settings = RivalTraining(episodes=4, batch=4, tests=1, test_campaigns=1, variety=NO_VARIETY)
    with pytest.raises(TrainingError, match="nothing to resume"):
        train_rival(learner("acktr"), tiny_sampler, settings, tmp_path, resume=True)
    scenario, places = short()
    train_rival(learner("acktr"), lambda _: (scenario, places), settings, tmp_path)
    with pytest.raises(TrainingError, match="--policy acktr"):
        train_rival(learner("aoi-drqn"), lambda _: (scenario, places), settings, tmp_path, resume=True)


@pytest.mark.parametrize("name", NAMES)
def test_choices_are_legal_exploring_or_not(name):
    rng = np.random.default_rng(0)
    trained = learner(name)
    scenario, places = short(uavs=2)
    world = VectorWorld(draw_campaigns(lambda _: (scenario, places), rng, 5, NO_VARIETY))
    trained.begin(world.scenario, 5)
    while not world.done:
        legal = world.legal()
        for explore in (1.0, None):
            actions = trained.choose(world.state, legal, explore)
            assert actions.shape == (5, 2)
            assert bool(legal.gather(-1, actions[..., None]).all())
        world.step(actions)


def test_a_checkpoint_of_another_method_or_a_damaged_one_is_one_line(tmp_path):
    save_learner(learner("acktr"), tmp_path / WEIGHTS)
    with pytest.raises(CheckpointError, match='acktr, not of "muzero"'):
        make_agent("muzero", checkpoint=str(tmp_path))
    (tmp_path / WEIGHTS).write_bytes(b"nothing")
    with pytest.raises(CheckpointError, match="copy it again"):
        make_agent("acktr", checkpoint=str(tmp_path))
    with pytest.raises(CheckpointError, match="no such file"):
        make_agent("acktr", checkpoint=str(tmp_path / "absent"))
    with pytest.raises(CheckpointError, match="policy train"):
        make_agent("acktr")


def test_settings_travel_with_the_weights(tmp_path):
    save_learner(learner("aoi-drqn", hidden=24), tmp_path / WEIGHTS)
    loaded = load_learner(agent_type("aoi-drqn").learner_type, tmp_path)
    assert loaded.settings.hidden == 24


@pytest.mark.parametrize("name", NAMES)
def test_settings_that_cannot_be_learned_with_are_refused(name):
    kind = agent_type(name).learner_type.settings_type
    for change in ({"batch_size": 0}, {"learning_rate": 0.0}, {"n_step": -1}, {"gamma": 1.5}, {"warmup_slots": -1}):
        with pytest.raises(ValueError, match=next(iter(change))):
            kind(**change)
    assert kind(warmup_slots=0, explore_end=0.0, gamma=1.0).warmup_slots == 0


def test_without_torch_a_rival_says_what_to_install(monkeypatch):
    for module in [m for m in sys.modules if m.startswith(("policy.agents.muzero", "policy.agents.rivals"))]:
        monkeypatch.delitem(sys.modules, module)
    real = builtins.__import__

    def no_torch(name, *arguments, **options):
        if name.partition(".")[0] == "torch":
            raise ModuleNotFoundError("No module named 'torch'", name="torch")
        return real(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", no_torch)
    with pytest.raises(UnknownPolicyError, match=r"\[train\] extra"):
        make_agent("muzero")
