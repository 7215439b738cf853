"""No policy reads a user's position later than the present slot."""

import numpy as np
import pytest
from fresh_rivals import any_agent

from policy.agents.registry import policy_names
from policy.evaluation.rollout import fly
from policy.mission_file import load_mission, open_campaign
from policy.mobility.feed import TraceFeed
from policy.mobility.traces import UserTraces

KNOWN = 6
"""Samples 0 .. KNOWN are the same in both worlds, so decisions 0 .. KNOWN must be."""


def scrambled(traces: UserTraces) -> UserTraces:
    """Everyone is somewhere else after sample KNOWN."""
    pos_m = traces.pos_enu_m.copy()
    pos_m[KNOWN + 1 :] = np.random.default_rng(99).uniform(0.0, 900.0, size=pos_m[KNOWN + 1 :].shape)
    return UserTraces(traces.user_ids, pos_m, traces.slot_s, "scrambled")


@pytest.mark.parametrize("name", policy_names())
@pytest.mark.parametrize("accel", [float("inf"), 4.5])
def test_a_scrambled_future_changes_no_decision(tiny, name, accel):
    scenario, traces = open_campaign(load_mission(tiny))
    scenario = scenario.with_accel(accel)
    assert traces is not None
    ways = [
        fly(scenario, TraceFeed(users).as_places(), any_agent(name), seed=5) for users in (traces, scrambled(traces))
    ]
    for slot in range(KNOWN + 1):
        assert np.array_equal(ways[0].heading_rad[slot], ways[1].heading_rad[slot])
        assert np.array_equal(ways[0].speed_mps[slot], ways[1].speed_mps[slot])
    assert not np.array_equal(ways[0].states[-1].user_pos_enu_m, ways[1].states[-1].user_pos_enu_m)


@pytest.mark.parametrize("name", policy_names())
def test_the_same_seed_flies_the_same_way(tiny, name):
    scenario, traces = open_campaign(load_mission(tiny))
    assert traces is not None
    agent = any_agent(name)
    first, again = (fly(scenario, TraceFeed(traces).as_places(), agent, seed=5) for _ in range(2))
    assert np.array_equal(np.stack(first.heading_rad), np.stack(again.heading_rad))
    assert first.metrics == again.metrics
