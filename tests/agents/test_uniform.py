"""Random flight: inside the map, every action alike, the same for the same seed."""

import math
from dataclasses import replace

import numpy as np

from policy.agents.uniform import UniformAgent
from policy.evaluation.rollout import fly
from policy.world.scenario import Area, Scenario
from policy.world.state import initial_state

SCENARIO = Scenario(
    area=Area((40.42, -86.93), (1600.0, 1200.0)),
    launch_enu_m=np.array([[800.0, 600.0], [800.0, 600.0]]),
    collect_mbps=np.full(4, 0.02),
    slots=40,
)
USERS = np.array([[100.0, 100.0], [800.0, 700.0], [1500.0, 1100.0], [300.0, 900.0]])


class Standing:
    def positions(self, sample: int) -> np.ndarray:
        return USERS


def test_every_action_is_drawn_alike() -> None:
    agent = UniformAgent()
    agent.reset(replace(SCENARIO, area=Area((40.0, -86.0), (9000.0, 9000.0))), 3)
    state = replace(initial_state(SCENARIO, USERS), uav_pos_enu_m=np.full((2, 2), 4500.0))
    actions = [agent.decide(state).action for _ in range(900)]
    hovering = np.mean([np.mean(action.speed_mps == 0.0) for action in actions])
    assert abs(hovering - 1.0 / 9.0) < 0.025
    north = np.mean([np.mean((action.speed_mps > 0.0) & (action.heading_rad == 0.0)) for action in actions])
    assert abs(north - 1.0 / 9.0) < 0.025


def test_it_stays_inside_at_any_acceleration() -> None:
    for accel in (math.inf, 4.5, 2.5):
        for seed in range(5):
            record = fly(SCENARIO.with_accel(accel), Standing(), UniformAgent(), seed)
            assert record.violations["geofence"] == 0


def test_as_the_paper_has_it_it_leaves_the_map() -> None:
    agent = UniformAgent(keep_inside=False)
    assert sum(fly(SCENARIO, Standing(), agent, seed).violations["geofence"] for seed in range(5)) > 0


def test_one_seed_one_flight() -> None:
    first, again, other = (fly(SCENARIO, Standing(), UniformAgent(), seed) for seed in (1, 1, 2))
    assert np.array_equal(first.heading_rad, again.heading_rad)
    assert not np.array_equal(first.heading_rad, other.heading_rad)
