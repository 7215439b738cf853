"""Table II: time of a decision on one thread. All methods take turns slot by slot in one process with nothing beside
it, so that a busy moment of the machine falls on all alike.
"""

import hashlib
import time
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np

from policy.agents.base import Agent
from policy.evaluation.tables.campuses import Campus, canonical
from policy.evaluation.tables.cells import code_version
from policy.evaluation.tables.grid import BASE_MCL_DB, BASE_UAVS
from policy.evaluation.tables.methods import Method
from policy.mobility.feed import TraceFeed, TracePlaces
from policy.mobility.traces import UserTraces
from policy.world.scenario import Scenario
from policy.world.state import WorldState, initial_state
from policy.world.transition import step


@dataclass(frozen=True)
class TimingTask:
    """All methods on one campus."""

    key: str
    campus: str
    methods: tuple[tuple[str, Method], ...]  # name, method
    scenario: Scenario
    traces: UserTraces
    slots: int


def make_timing(campus: Campus, methods: Sequence[tuple[str, Method]], slots: int, machine: str) -> TimingTask:
    """A time belongs to a machine, so its name is part of the key."""
    scenario, traces = campus.opened(BASE_UAVS, BASE_MCL_DB)
    slots = min(slots, scenario.slots)
    inputs = {
        "timing": campus.digest(BASE_UAVS, BASE_MCL_DB),
        "methods": [[name, method.document()] for name, method in methods],
        "slots": slots,
        "machine": machine,
        "code": code_version(),
    }
    key = "timing-" + hashlib.sha256(canonical(inputs).encode()).hexdigest()[:25]
    return TimingTask(key, campus.name, tuple(methods), scenario, traces, slots)


class _Turn:
    """One method's own campaign, one slot at a time."""

    def __init__(self, agent: Agent, scenario: Scenario, traces: UserTraces) -> None:
        self._agent, self._scenario = agent, scenario
        self._places: TracePlaces = TraceFeed(traces).as_places()
        self._state: WorldState = initial_state(scenario, self._places.positions(0))
        agent.reset(scenario, 0)

    def take(self, slot: int) -> float:
        """Decide and fly slot ``slot``: the milliseconds of the decision."""
        begun_s = time.perf_counter()
        action = self._agent.decide(self._state).action
        spent_ms = 1e3 * (time.perf_counter() - begun_s)
        self._state, _ = step(self._scenario, self._state, action, self._places.positions(slot + 1))
        return spent_ms


def time_decisions(task: TimingTask) -> dict[str, Any]:
    """What the timing's file holds: for each method its decisions' milliseconds in the order of the slots."""
    turns = {name: _Turn(method.choice().build(), task.scenario, task.traces) for name, method in task.methods}
    spent_ms: dict[str, list[float]] = {name: [] for name in turns}
    for slot in range(task.slots):
        for name, turn in turns.items():
            spent_ms[name].append(turn.take(slot))
    return {
        "key": task.key,
        "campus": task.campus,
        "uavs": task.scenario.num_uavs,
        "users": task.scenario.num_users,
        "slots": task.slots,
        "code": code_version(),
        "finished_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "methods": {name: _summary(values) for name, values in spent_ms.items()},
    }


def _summary(spent_ms: Sequence[float]) -> dict[str, float]:
    p50, p99 = np.percentile(spent_ms, (50.0, 99.0))
    return {"mean": float(np.mean(spent_ms)), "p50": float(p50), "p99": float(p99)}
