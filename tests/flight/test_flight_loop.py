"""The loop itself: order of a tick, missed ticks, spreading, requests from other threads."""

import threading
from itertools import pairwise

import pytest
from fake_fleet import FakeFleet, FakeVehicle, MemoryJournal

from gcs.flight_loop import TICK_S, FlightLoop
from gcs.mission.manager import MissionManager
from gcs.ports import (
    CommandKind,
    OperatorRequest,
    RequestKind,
    SafeSetpoint,
    VehicleCommand,
    VelocitySetpoint,
    VerdictResult,
)
from gcs.safety.envelope import Envelope
from gcs.safety.gate import SafetyGate, Wish
from policy.world.frames import LocalFrame

FRAME = LocalFrame(40.0, -86.0)


class JumpyClock:
    """A wall clock that oversleeps by a script, in seconds per wait."""

    is_virtual = False

    def __init__(self, oversleep_s: list[float]) -> None:
        self._now_s, self._script = 0.0, list(oversleep_s)
        self.waits: list[float] = []

    def now_s(self) -> float:
        return self._now_s

    def wait_until(self, time_s: float) -> None:
        self.waits.append(time_s)
        self._now_s = max(self._now_s, time_s) + (self._script.pop(0) if self._script else 0.0)


class Crowd(MissionManager):
    """A manager that streams to many drones."""

    def __init__(self, link: FakeFleet, journal: MemoryJournal, count: int) -> None:
        super().__init__(link, journal, virtual=False)
        gate = SafetyGate(Envelope((100.0, 100.0)))
        self._safe = gate.judge([Wish(VelocitySetpoint(i + 1, (0.0, 0.0, 0.0), 0.0), None) for i in range(count)])

    def step(self, now_s: float) -> list:  # type: ignore[type-arg]
        return self._safe


def loop_of(clock: object, count: int = 2) -> tuple[FlightLoop, FakeFleet, MemoryJournal]:
    fleet = FakeFleet(FRAME, [FakeVehicle(i + 1, 5.0 * i, 0.0) for i in range(count)])
    journal = MemoryJournal()
    manager = MissionManager(fleet, journal, virtual=False)
    return FlightLoop(clock, fleet, manager, journal), fleet, journal  # type: ignore[arg-type]


def test_missed_ticks_are_counted_and_not_made_up_for() -> None:
    clock = JumpyClock([0.0, 0.0, 1.07, 0.0, 0.0])
    loop, fleet, journal = loop_of(clock)
    times = [loop.tick().time_s for _ in range(5)]
    assert times == pytest.approx([0.0, 0.1, 1.27, 1.3, 1.4])
    assert fleet.flushes == 5, "one tick each, no burst"
    for _ in range(120):
        loop.tick()
    missed = [event for event in journal.events if event.kind == "loop.missed"]
    assert [event.message.split()[0] for event in missed] == ["10"]


def test_a_large_fleet_is_sent_to_in_bursts_within_the_tick() -> None:
    clock, journal = JumpyClock([]), MemoryJournal()
    fleet = FakeFleet(FRAME, [FakeVehicle(i + 1, 0.0, 0.0) for i in range(35)])
    loop = FlightLoop(clock, fleet, Crowd(fleet, journal, 35), journal)
    loop.tick()
    starts = sorted({time_s for time_s, _ in fleet.sent})
    assert len(fleet.sent) == 35
    assert len(starts) == 4
    assert starts[-1] < TICK_S


class Laborious(FakeFleet):
    """Taking in what the vehicles say costs a script of times, in seconds per tick."""

    def __init__(self, count: int, clock: JumpyClock, work_s: list[float]) -> None:
        super().__init__(FRAME, [FakeVehicle(i + 1, 0.0, 0.0) for i in range(count)])
        self._clock, self._work_s = clock, list(work_s)

    def poll(self, now_s: float) -> None:
        super().poll(now_s)
        self._clock.wait_until(self._clock.now_s() + self._work_s.pop(0))


def sent_s(work_s: list[float], count: int = 100) -> list[list[float]]:
    """When each drone was sent to, tick by tick: [tick][drone]."""
    clock, journal = JumpyClock([]), MemoryJournal()
    fleet = Laborious(count, clock, work_s)
    loop = FlightLoop(clock, fleet, Crowd(fleet, journal, count), journal)
    for _ in work_s:
        loop.tick()
    times_s = [time_s for time_s, _ in fleet.sent]
    return [times_s[tick * count : (tick + 1) * count] for tick in range(len(work_s))]


def test_a_large_fleets_setpoints_leave_evenly_however_long_a_tick_works() -> None:
    even = sent_s([0.0] * 6)
    assert sent_s([0.0, 0.012, 0.045, 0.001, 0.05, 0.02]) == even
    assert even[0][0] == pytest.approx(0.5 * TICK_S)
    assert even[0][-1] < 0.9 * TICK_S, "the next tick is not late for them"
    periods_s = [later[i] - before[i] for before, later in pairwise(even) for i in (0, 99)]
    assert periods_s == pytest.approx([TICK_S] * 10)


def test_a_tick_that_works_for_longer_delays_the_first_ones_only_and_never_sends_in_one_burst() -> None:
    late, even = sent_s([0.06])[0], sent_s([0.0])[0]
    assert late[0] == pytest.approx(0.06)
    assert late[-1] == pytest.approx(even[-1], abs=1e-3), "the last ones leave at their time"
    starts_s = sorted(set(sent_s([0.2])[0]))
    assert len(starts_s) == 5
    assert min(later - before for before, later in pairwise(starts_s)) > 0.0015


def test_a_small_fleets_setpoints_leave_at_once() -> None:
    assert sent_s([0.003], count=3) == [[0.003] * 3]


def test_who_watches_does_not_wait_for_the_setpoints_of_a_large_fleet(monkeypatch: pytest.MonkeyPatch) -> None:
    """They leave over most of a tick; the places that they were worked out from are told before."""
    clock, journal = JumpyClock([]), MemoryJournal()
    fleet = FakeFleet(FRAME, [FakeVehicle(i + 1, 0.0, 0.0) for i in range(35)])
    loop = FlightLoop(clock, fleet, Crowd(fleet, journal, 35), journal)
    told: list[int] = []
    send = fleet.send
    monkeypatch.setattr(fleet, "send", lambda safe, now_s: (told.append(loop.snapshot().tick), send(safe, now_s)))
    loop.tick(), loop.tick()
    assert told == [1] * 35 + [2] * 35


def test_a_command_ends_with_the_vehicles_own_verdict() -> None:
    loop, _fleet, journal = loop_of(JumpyClock([]))
    loop.tick()
    early = loop.submit(OperatorRequest(RequestKind.COMMAND, "ann", command=VehicleCommand(CommandKind.ARM, 1)))
    loop.tick()
    outcome = early.result(timeout=0)
    assert not outcome.accepted
    assert outcome.verdict is not None
    assert outcome.verdict.result is VerdictResult.REFUSED
    assert "position estimate" in outcome.reason
    assert any(event.kind == "command.verdict" and event.actor == "ann" for event in journal.events)


def test_requests_come_from_any_thread_and_a_cancelled_one_is_dropped() -> None:
    loop, _fleet, _ = loop_of(JumpyClock([]))
    loop.tick()
    answers = []
    request = OperatorRequest(RequestKind.PAUSE, "bob")
    threads = [threading.Thread(target=lambda: answers.append(loop.submit(request))) for _ in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    answers[0].cancel()
    loop.tick()
    assert all("no campaign" in answer.result(timeout=0).reason for answer in answers[1:])
    assert answers[0].cancelled()


def test_a_start_without_a_mission_is_refused_and_health_follows_the_ticks() -> None:
    loop, _, _ = loop_of(JumpyClock([]))
    assert not loop.healthy()
    loop.tick()
    assert loop.healthy()
    assert not loop.submit(OperatorRequest(RequestKind.START, "eve")).result(timeout=0).accepted


def test_heartbeats_stop_when_the_manager_breaks() -> None:
    loop, fleet, _ = loop_of(JumpyClock([]))
    loop.tick()

    def broken(now_s: float) -> list[SafeSetpoint]:
        raise RuntimeError("a defect")

    loop._manager.step = broken  # type: ignore[assignment,method-assign]
    for _ in range(3):
        loop.tick()
    assert fleet.flushes == 1, "nothing vouches for a mission that no longer steps"


def test_a_request_that_fails_is_refused_and_ends_no_flight() -> None:
    loop, fleet, _ = loop_of(JumpyClock([]))

    def broken(now_s: float, actor: str, system_id: int | None = None) -> None:
        raise KeyError("a defect")

    loop._manager.stop = broken  # type: ignore[method-assign]
    answer = loop.submit(OperatorRequest(RequestKind.EMERGENCY_STOP, "bob"))
    loop.tick()
    assert "KeyError" in answer.result(timeout=0).reason
    loop.tick()
    assert fleet.flushes == 2
