"""A policy of this process, asked in its own thread so that the flight loop never waits for it."""

import logging
import queue
import threading
import time
from collections.abc import Callable

import numpy as np

from gcs.ports import PlanFailure, Planner, PlanTicket
from policy.agents.base import Agent, Decision
from policy.world.scenario import Scenario
from policy.world.state import WorldState, initial_state

logger = logging.getLogger(__name__)


class Answer:
    """A decision under way (ports.PlanTicket); thread-safe."""

    def __init__(self) -> None:
        self._ready = threading.Event()
        self._answer: Decision | PlanFailure | None = None
        self._duration_ms: float | None = None

    def poll(self) -> Decision | PlanFailure | None:
        """The answer, or None."""
        return self._answer if self._ready.is_set() else None

    def wait(self, timeout_s: float) -> None:
        """Wait on the wall clock."""
        self._ready.wait(timeout_s)

    @property
    def duration_ms(self) -> float | None:
        """How long the decision took."""
        return self._duration_ms if self._ready.is_set() else None

    def settle(self, answer: Decision | PlanFailure, duration_ms: float | None = None) -> None:
        """Give the answer; once."""
        self._answer, self._duration_ms = answer, duration_ms
        self._ready.set()


class ThreadedPlanner(Planner):
    """One worker thread, one agent. A newer request replaces one that has not been begun."""

    def __init__(self, make_agent: Callable[[], Agent]) -> None:
        self._make_agent = make_agent
        self._agent: Agent | None = None
        self._broken: str | None = None
        self._jobs: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._pending: Answer | None = None
        self._thread = threading.Thread(target=self._work, name="planner", daemon=True)
        self._thread.start()

    def begin(self, scenario: Scenario, seed: int) -> None:
        """Load and warm the agent up during the launch; what goes wrong is told at the first request."""
        self._jobs.put(lambda: self._prepare(scenario, seed))

    def request(self, state: WorldState) -> PlanTicket:
        """Ask; never blocks."""
        if self._pending is not None and self._pending.poll() is None:
            self._pending.settle(PlanFailure("replaced by a newer request"))
        answer = Answer()
        self._pending = answer
        self._jobs.put(lambda: self._decide(state, answer))
        return answer

    def close(self) -> None:
        """End the worker; a decision under way is not waited for."""
        self._jobs.put(None)

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None:
            job()

    def _prepare(self, scenario: Scenario, seed: int) -> None:
        try:
            agent = self._agent or self._make_agent()
            agent.reset(scenario, seed)
            centre_m = 0.5 * np.asarray(scenario.area.size_m)
            agent.decide(initial_state(scenario, np.tile(centre_m, (scenario.num_users, 1))))  # compiles kernels
            agent.reset(scenario, seed)
        except Exception as error:  # a policy is foreign code: whatever it raises, drones hold
            logger.exception("the policy could not begin")
            self._broken = f"the policy could not begin: {error}"
        else:
            self._agent, self._broken = agent, None

    def _decide(self, state: WorldState, answer: Answer) -> None:
        if answer.poll() is not None:
            return
        if self._broken is not None or self._agent is None:
            answer.settle(PlanFailure(self._broken or "the policy was not begun"))
            return
        begun_s = time.perf_counter()
        try:
            decision = self._agent.decide(state)
        except Exception as error:  # see _prepare
            logger.exception("the policy failed")
            answer.settle(PlanFailure(f"the policy failed: {error}"))
        else:
            answer.settle(decision, 1e3 * (time.perf_counter() - begun_s))
