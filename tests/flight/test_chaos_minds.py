"""A planner dead, slow or talking nonsense, a store stalled or full: drones hold, it is told, the stream goes on.

The loop runs on a clock set by the test, as in real time: nothing waits for a decision.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import Engine
from test_campaign import SLOTS, Flight, square

from gcs.flight_loop import FlightLoop
from gcs.mission.manager import MissionManager
from gcs.mission.order import CampaignOrder
from gcs.mission.threaded_planner import Answer, ThreadedPlanner
from gcs.ports import CampaignState, PlanFailure, Planner
from gcs.store.engine import open_engine
from gcs.store.event_tail import EventTail
from gcs.store.journal import StoreJournal
from gcs.store.migrate import upgrade
from policy.agents.base import Agent, Decision
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState

OFFBOARD_LOSS_S = 1.0  # PX4's COM_OF_LOSS_T


class SlowPlanner:
    """Answers ten seconds of flight time later, when nobody waits for it any more."""

    def __init__(self, flight: Flight) -> None:
        self._flight, self._open = flight, list[tuple[float, Answer, WorldState]]()

    def begin(self, scenario: Scenario, seed: int) -> None:
        pass

    def request(self, state: WorldState) -> Answer:
        answer = Answer()
        self._open.append((self._flight.fleet.now_s() + 10.0, answer, state))
        return answer

    def tick(self) -> None:
        for due_s, answer, state in self._open:
            if self._flight.fleet.now_s() >= due_s and answer.poll() is None:
                answer.settle(square(state), 10_000.0)

    def close(self) -> None:
        pass


class DyingAgent:
    """A policy that raises whatever it likes."""

    def reset(self, scenario: Scenario, seed: int) -> None:
        pass

    def decide(self, state: WorldState) -> Decision:
        raise MemoryError("the policy is dead")


def stream_gap_s(flight: Flight, begun_s: float, ended_s: float) -> float:
    gaps = []
    for vehicle in flight.vehicles:
        times = [t for t in vehicle.setpoint_times_s if begun_s <= t <= ended_s]
        gaps.append(float(np.max(np.diff(times))))
    return max(gaps)


def fly_slots(flight: Flight, tick: object = None) -> tuple[float, float]:
    flight.start()
    begun_s = flight.until_state(CampaignState.FLYING).time_s
    while flight.loop.tick().campaign.state is CampaignState.FLYING:
        if callable(tick):
            tick()
    ended_s = flight.fleet.now_s()
    flight.until_state(CampaignState.DONE)
    return begun_s, ended_s


def check_held(flight: Flight, begun_s: float, ended_s: float, kind: str) -> None:
    """Told in every slot, nobody moved, the stream never stale, everybody home."""
    assert flight.journal.kinds().count(kind) == SLOTS
    for record in flight.journal.slots[1:]:
        assert all(uav.speed_mps < 1.0 for uav in record.uavs)
    assert stream_gap_s(flight, begun_s, ended_s) < 0.5 * OFFBOARD_LOSS_S
    assert not any(vehicle.armed for vehicle in flight.vehicles)


def test_a_planner_ten_seconds_slow() -> None:
    flight = Flight(is_virtual=False)
    planner = SlowPlanner(flight)
    flight.order = with_planner(flight, planner)
    check_held(flight, *fly_slots(flight, planner.tick), "plan.late")


def test_a_planner_that_never_answers() -> None:
    flight = Flight(is_virtual=False, decide=lambda state: None)
    check_held(flight, *fly_slots(flight), "plan.late")


@pytest.mark.parametrize(
    ("answer", "kind"),
    [
        (Decision(JointAction(np.zeros(5), np.zeros(5))), "plan.rejected"),
        (Decision(JointAction(np.zeros((2, 2)), np.zeros(2))), "plan.rejected"),
        (Decision(JointAction(np.full(2, np.nan), np.zeros(2))), "plan.rejected"),
        (Decision(JointAction(np.zeros(2), np.full(2, np.inf))), "plan.rejected"),
        (Decision(JointAction(np.array(["north", "east"]), np.zeros(2))), "plan.rejected"),
        (PlanFailure("the policy's process has ended"), "plan.failed"),
    ],
)
def test_a_planner_that_answers_nonsense(answer: Decision | PlanFailure, kind: str) -> None:
    flight = Flight(is_virtual=False, decide=lambda state: answer)
    check_held(flight, *fly_slots(flight), kind)


def test_a_planner_whose_agent_dies() -> None:
    """In lock step: the loop waits for the thread's answer, so that the count is the same each time."""

    def make() -> Agent:
        return DyingAgent()  # type: ignore[return-value]

    flight = Flight()
    planner = ThreadedPlanner(make)
    flight.order = with_planner(flight, planner)
    check_held(flight, *fly_slots(flight), "plan.failed")


def with_planner(flight: Flight, planner: Planner) -> CampaignOrder:
    return replace(flight.order, planner=planner)


# --- the store ----------------------------------------------------------------------------------------------------


@contextmanager
def held(engine: Engine) -> Iterator[None]:
    """Another process holds the database: nobody can write."""
    with engine.connect() as connection:
        connection.exec_driver_sql("BEGIN IMMEDIATE")
        yield
        connection.rollback()


def reach(flight: Flight, state: CampaignState, limit_s: float = 1500.0) -> None:
    """By the manager's own word: what is told waits for the store, which has another clock than the flight."""
    end_s = flight.fleet.now_s() + limit_s
    flight.loop.run(until=lambda s: flight.manager.campaign.state is state or s.time_s > end_s)
    assert flight.manager.campaign.state is state


@pytest.mark.parametrize("capacity", [100_000, 50], ids=["stalled", "full"])
def test_a_store_that_stalls_or_is_full(capacity: int, tmp_path: Path) -> None:
    """The drones fly their slots as if nothing were; what is lost is counted and told."""
    engine = open_engine(f"sqlite:///{tmp_path / 'store.sqlite3'}")
    upgrade(engine)
    tail = EventTail()
    journal = StoreJournal(engine, tail, capacity=capacity)
    flight = Flight(is_virtual=False)
    flight.manager = MissionManager(flight.fleet, journal, virtual=False)
    flight.loop = FlightLoop(flight.fleet, flight.fleet, flight.manager, journal)
    slowest_s = 0.0
    with held(engine):
        flight.start()
        reach(flight, CampaignState.FLYING)
        begun_s = flight.fleet.now_s()
        while flight.manager.campaign.state is CampaignState.FLYING:
            before_s = time.thread_time()
            wall_s = time.monotonic()
            flight.loop.tick()
            waited_s = time.monotonic() - wall_s - (time.thread_time() - before_s)
            slowest_s = max(slowest_s, waited_s)
        ended_s = flight.fleet.now_s()
        reach(flight, CampaignState.DONE)
    assert stream_gap_s(flight, begun_s, ended_s) < 0.5 * OFFBOARD_LOSS_S
    assert slowest_s < OFFBOARD_LOSS_S, "no tick waited for the store for as long as ends OFFBOARD"
    assert not any(vehicle.armed for vehicle in flight.vehicles)
    told = {kind for kind, _ in tail.counts()}
    journal.close(30.0)
    engine.dispose()
    health = journal.health()
    assert (health.lost > 0) is (capacity == 50)
    assert told & {"store.late", "store.overflow", "store.failing"}
