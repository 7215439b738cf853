"""Every rival learns: it comes within 5 % of the optimum of a tiny campaign (`make rivals`, minutes on one core)."""

import pytest
from tiny_campaign import OPTIMUM, SLOTS, USERS_M, best_episodic_aoi, tiny_places, tiny_sampler, tiny_scenario

from policy.agents.registry import RIVALS, agent_type, make_agent
from policy.evaluation.rollout import fly
from policy.training.campaign_draws import NO_VARIETY
from policy.training.collect import ArrayPlaces
from policy.training.rival_settings import RivalTraining
from policy.training.rivals import train_rival

pytestmark = pytest.mark.rivals

SMALL = {
    "drl-freshmcs": {"batch_size": 32, "warmup_slots": 500, "target_every": 100, "updates_per_slot": 1.0},
    "aoi-drqn": {"batch_size": 32, "warmup_slots": 500, "target_every": 100, "updates_per_slot": 1.0},
    "muzero": {"batch_size": 32, "warmup_slots": 500, "simulations": 12},
    "acktr": {},
}
"""A tiny campaign has less to remember and to learn from; all else is the default."""
EPISODES = {"drl-freshmcs": 480, "aoi-drqn": 480, "muzero": 480, "acktr": 1280}


@pytest.mark.timeout(1200)
def test_the_optimum_is_what_exhaustive_search_finds():
    assert best_episodic_aoi(tiny_scenario(), USERS_M) == pytest.approx(OPTIMUM)


@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", sorted(RIVALS))
def test_a_rival_comes_within_five_percent_of_the_optimum(name, tmp_path):
    kind = agent_type(name).learner_type
    learner = kind(kind.settings_type(**SMALL[name]))
    settings = RivalTraining(episodes=EPISODES[name], batch=16, tests=10, test_campaigns=1, variety=NO_VARIETY)
    train_rival(learner, tiny_sampler, settings, tmp_path)
    record = fly(tiny_scenario(), ArrayPlaces(tiny_places()), make_agent(name, checkpoint=str(tmp_path)))
    assert len(record.outcomes) == SLOTS
    assert record.metrics.episodic_aoi <= 1.05 * OPTIMUM
    assert record.violations == {"geofence": 0, "separation": 0, "obstacle": 0, "battery": 0}
