"""A small campaign to ask decisions for."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest
import uvicorn

from policy.agents.registry import PolicyChoice
from policy.service.app import create_app
from policy.service.server import bind
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


@contextmanager
def serving(default: PolicyChoice | None = None) -> Iterator[str]:
    """The application on a free port of this machine, in a thread: its address."""
    bound = bind("127.0.0.1", 0)
    server = uvicorn.Server(uvicorn.Config(create_app(default), log_level="error", access_log=False, ws="none"))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]})
    thread.start()
    try:
        yield f"http://127.0.0.1:{bound.getsockname()[1]}"
    finally:
        server.should_exit = True
        thread.join(timeout=20)
        bound.close()


@pytest.fixture(scope="session")
def address() -> Iterator[str]:
    """A service whose default policy is random."""
    with serving(PolicyChoice("random")) as url:
        yield url
