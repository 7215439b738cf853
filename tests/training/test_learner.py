from dataclasses import replace

import numpy as np
import pytest
import torch
from tests_training_small import SMALL_RUN, made_episode

from policy.model.network import GcrlNetwork
from policy.training.learner import Learner
from policy.training.replay import Batch, make_batch
from policy.training.settings import TrainingError


def make_learner() -> Learner:
    torch.manual_seed(0)
    return Learner(GcrlNetwork(SMALL_RUN.model), SMALL_RUN)


def some_batch() -> Batch:
    episodes = [made_episode(6, 2, 4, seed) for seed in range(4)]
    return make_batch(episodes, [0, 1, 2, 3], n_step=2, gamma=0.9)


def test_what_is_repeated_is_learned() -> None:
    learner, batch = make_learner(), some_batch()
    first = sum(learner.update(batch, 1e-2))
    for _ in range(60):
        last = sum(learner.update(batch, 1e-2))
    assert last < 0.7 * first


def test_the_target_follows_at_intervals() -> None:
    learner, batch = make_learner(), some_batch()
    before = learner.state()["target"]["value.0.weight"].clone()
    for _ in range(SMALL_RUN.target_every - 1):
        learner.update(batch, 1e-2)
    state = learner.state()
    assert torch.equal(state["target"]["value.0.weight"], before)
    learner.update(batch, 1e-2)
    state = learner.state()
    assert torch.equal(state["target"]["value.0.weight"], state["network"]["value.0.weight"])
    assert not torch.equal(state["target"]["value.0.weight"], before)


def test_numbers_that_are_none_stop_the_run_and_change_nothing() -> None:
    learner, batch = make_learner(), some_batch()
    before = {name: tensor.clone() for name, tensor in learner.network.state_dict().items()}
    with pytest.raises(TrainingError, match="not finite"):
        learner.update(replace(batch, cost_slots=np.full_like(batch.cost_slots, np.nan)), 1e-3)
    assert all(torch.equal(before[name], tensor) for name, tensor in learner.network.state_dict().items())


def test_restored_it_goes_on_alike() -> None:
    one, batch = make_learner(), some_batch()
    one.update(batch, 1e-3)
    other = Learner(GcrlNetwork(SMALL_RUN.model), SMALL_RUN)
    other.restore(one.state())
    assert one.update(batch, 1e-3) == other.update(batch, 1e-3)
