"""Table II: time of a decision on one thread. All methods take turns slot by slot in one process with nothing beside
it, so that a busy moment of the machine falls on all alike. Processor time is taken beside wall time: where the two
differ, something else wanted the processor.
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
from policy.evaluation.tables.grid import BASE_MCL_DB, BASE_UAVS
from policy.evaluation.tables.methods import Method
from policy.evaluation.tables.sources import code_version
from policy.mobility.feed import TraceFeed, TracePlaces
from policy.mobility.traces import UserTraces
from policy.world.scenario import Scenario
from policy.world.state import WorldState, initial_state
from policy.world.transition import step

LAYOUT = 2
"""Of the file; files of another are measured again."""


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
        "timing": [LAYOUT, campus.digest(BASE_UAVS, BASE_MCL_DB)],
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

    def take(self, slot: int) -> tuple[float, float]:
        """Decide and fly slot ``slot``: the decision's milliseconds by the clock and of the processor."""
        begun_s, used_s = time.perf_counter(), time.process_time()
        action = self._agent.decide(self._state).action
        spent = (1e3 * (time.perf_counter() - begun_s), 1e3 * (time.process_time() - used_s))
        self._state, _ = step(self._scenario, self._state, action, self._places.positions(slot + 1))
        return spent


def time_decisions(task: TimingTask) -> dict[str, Any]:
    """What the timing's file holds: milliseconds of a decision for each method."""
    turns = {name: _Turn(method.choice().build(), task.scenario, task.traces) for name, method in task.methods}
    spent_ms: dict[str, list[tuple[float, float]]] = {name: [] for name in turns}
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


def _summary(spent_ms: Sequence[tuple[float, float]]) -> dict[str, float]:
    wall_ms, processor_ms = np.transpose(spent_ms)
    p50, p99 = np.percentile(wall_ms, (50.0, 99.0))
    processor = float(np.median(processor_ms))
    return {"mean": float(np.mean(wall_ms)), "p50": float(p50), "p99": float(p99), "processor_p50": processor}
