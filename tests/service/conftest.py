"""A small campaign to ask decisions for."""

import numpy as np
import pytest

from policy.world.scenario import Area, Obstacle, Scenario
from policy.world.state import WorldState, initial_state

TOWER = Obstacle("tower", 150.0, ((300.0, 300.0), (360.0, 300.0), (360.0, 380.0)))


@pytest.fixture
def scenario() -> Scenario:
    return Scenario(
        area=Area((47.0, 8.0), (1200.0, 900.0), (TOWER,)),
        launch_enu_m=np.array([[600.0, 450.0], [640.0, 450.0]]),
        collect_mbps=np.array([0.02, 0.03, 0.04, 0.02]),
        slots=8,
        max_accel_mps2=4.5,
    )


@pytest.fixture
def state(scenario: Scenario) -> WorldState:
    places = np.random.default_rng(1).uniform((0.0, 0.0), scenario.area.size_m, size=(4, 2))
    return initial_state(scenario, places)
