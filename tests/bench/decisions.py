"""Decision time by policy and number of UAVs: the whole `decide`, as a campaign calls it."""

import time

import numpy as np
from measures import percentile, summary

from policy.agents.base import Agent
from policy.agents.registry import RIVALS, agent_type, make_agent, policy_names
from policy.mobility.walkers import generate_walkers
from policy.world.scenario import Area, Scenario
from policy.world.state import initial_state
from policy.world.transition import step

USERS = 92
SIZE_M = (2100.0, 2175.0)


def decision_times(quick: bool) -> list[tuple[str, str, str]]:
    """All policies take their turn in every round, so that a slow moment of the machine meets them all."""
    slots = 8 if quick else 30
    rows = []
    for uavs in (2, 5, 11):
        runners = {name: _Runner(name, uavs) for name in policy_names()}
        for slot in range(slots):
            for runner in runners.values():
                runner.slot(slot)
        for name, runner in runners.items():
            rows.append((f"`{name}`, U = {uavs}", summary(runner.times_s, 1e3, 2), "ms"))
            rows.append(
                (f"`{name}`, U = {uavs}, 99th percentile", f"{1e3 * percentile(runner.times_s, 0.99):.2f}", "ms")
            )
    return rows


class _Runner:
    """One policy in one campaign of synthetic walkers."""

    def __init__(self, name: str, uavs: int) -> None:
        self._scenario = Scenario(
            area=Area((36.36, 127.35), SIZE_M),
            launch_enu_m=np.tile([[SIZE_M[0] / 2, SIZE_M[1] / 2]], (uavs, 1)),
            collect_mbps=np.full(USERS, 0.02),
        )
        self._places = generate_walkers(USERS, 121, 15.0, SIZE_M, 7).pos_enu_m
        self._agent = _agent(name)
        self._agent.reset(self._scenario, 0)
        self._state = initial_state(self._scenario, self._places[0])
        self._agent.decide(self._state)  # first calls compile and warm caches
        self.times_s: list[float] = []

    def slot(self, slot: int) -> None:
        begun_s = time.perf_counter()
        action = self._agent.decide(self._state).action
        self.times_s.append(time.perf_counter() - begun_s)
        self._state, _ = step(self._scenario, self._state, action, self._places[slot + 1])


def _agent(name: str) -> Agent:
    """A rival's decision takes as long with an untrained network as with a trained one."""
    if name not in RIVALS:
        return make_agent(name)
    kind = agent_type(name)
    return kind(learner=kind.learner_type(kind.learner_type.settings_type()))
