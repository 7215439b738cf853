"""The planner thread: answers, failures as values, newest request wins."""

import threading

import numpy as np
import pytest

from gcs.mission.slot_flight import decision_fault
from gcs.mission.threaded_planner import ThreadedPlanner
from gcs.ports import PlanFailure
from policy.agents.base import Decision
from policy.world.scenario import Area, Scenario
from policy.world.state import JointAction, WorldState, initial_state

SCENARIO = Scenario(Area((40.0, -86.0), (1000.0, 1000.0)), np.full((2, 2), 500.0), np.ones(3))
STATE = initial_state(SCENARIO, np.full((3, 2), 100.0))


class North:
    """Everyone north; counts how often it was begun."""

    name = "north"

    def __init__(self) -> None:
        self.resets: list[int] = []
        self.gate = threading.Event()
        self.gate.set()
        self.fail = False

    def reset(self, scenario: Scenario, seed: int) -> None:
        self.resets.append(seed)

    def decide(self, state: WorldState) -> Decision:
        self.gate.wait(5.0)
        if self.fail:
            raise ValueError("no way north")
        return Decision(JointAction(np.zeros(2), np.full(2, 10.0)))


def test_a_decision_comes_with_its_time() -> None:
    agent = North()
    planner = ThreadedPlanner(lambda: agent)
    planner.begin(SCENARIO, 7)
    ticket = planner.request(STATE)
    ticket.wait(5.0)
    answer = ticket.poll()
    assert isinstance(answer, Decision)
    assert ticket.duration_ms is not None
    assert agent.resets == [7, 7], "warmed up, then begun afresh"
    planner.close()


def test_failures_are_values() -> None:
    agent = North()
    planner = ThreadedPlanner(lambda: agent)
    planner.begin(SCENARIO, 0)
    first = planner.request(STATE)
    first.wait(5.0)
    agent.fail = True
    ticket = planner.request(STATE)
    ticket.wait(5.0)
    answer = ticket.poll()
    assert isinstance(answer, PlanFailure)
    assert "no way north" in answer.reason
    planner.close()


def test_a_policy_that_cannot_begin_says_so_at_the_first_request() -> None:
    def broken() -> North:
        raise OSError("no checkpoint")

    planner = ThreadedPlanner(broken)
    planner.begin(SCENARIO, 0)
    ticket = planner.request(STATE)
    ticket.wait(5.0)
    answer = ticket.poll()
    assert isinstance(answer, PlanFailure)
    assert "no checkpoint" in answer.reason
    planner.close()


def test_a_newer_request_replaces_one_not_begun() -> None:
    agent = North()
    planner = ThreadedPlanner(lambda: agent)
    planner.begin(SCENARIO, 0)
    warm = planner.request(STATE)
    warm.wait(5.0)
    agent.gate.clear()
    slow, older, newer = planner.request(STATE), planner.request(STATE), planner.request(STATE)
    assert isinstance(older.poll(), PlanFailure)
    agent.gate.set()
    newer.wait(5.0)
    assert isinstance(newer.poll(), Decision)
    assert slow.poll() is not None
    planner.close()


@pytest.mark.parametrize(
    ("heading", "speed", "words"),
    [
        ([0.0, 1.0], [18.0, 0.0], None),
        ([0.0], [18.0], "shapes"),
        ([0.0, np.inf], [1.0, 1.0], "NaN or infinity"),
        ([0.0, 0.0], [1.0, -1.0], "-1 to 1"),
        ([0.0, 0.0], [1.0, 18.1], "18.1"),
        (["a", "b"], [1.0, 1.0], "not numbers"),
    ],
)
def test_decision_faults(heading: list[float], speed: list[float], words: str | None) -> None:
    fault = decision_fault(Decision(JointAction(np.array(heading), np.array(speed))), 2, 18.0)
    assert fault is None if words is None else (fault is not None and words in fault)


@pytest.mark.parametrize(
    ("heading", "speed", "words"),
    [
        ([0.0, 1.0], [18.0, 0.0], None),
        ([0.0], [18.0], "at the slot's end"),
        ([0.0, np.nan], [1.0, 1.0], "NaN or infinity"),
        ([0.0, 0.0], [1.0, 18.1], "18.1"),
    ],
)
def test_faults_of_the_velocities_at_the_slots_end(heading: list[float], speed: list[float], words: str | None) -> None:
    action = JointAction(np.zeros(2), np.full(2, 9.0), np.array(heading), np.array(speed))
    fault = decision_fault(Decision(action), 2, 18.0)
    assert fault is None if words is None else (fault is not None and words in fault)
