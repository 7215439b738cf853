"""The dead man: a stalled or failing loop holds its drones, then falls silent. Its clock is set by hand."""

import math
import threading

import pytest
from test_campaign import Flight

from gcs.dead_man import HOLD_AFTER_S, SILENT_AFTER_S, DeadMan
from gcs.flight_loop import FAILING_HELD_S
from gcs.ports import CampaignState, FlightMode, SafeSetpoint, VelocitySetpoint
from gcs.safety.envelope import Envelope
from gcs.safety.gate import SafetyGate, SealedSetpoint, Wish


def sealed(system_id: int = 1) -> SealedSetpoint:
    wish = Wish(VelocitySetpoint(system_id, (float("nan"), 0.0, 0.0), 1.0), None)
    (made,) = SafetyGate(Envelope((100.0, 100.0))).judge([wish])
    return made


class Wire:
    def __init__(self) -> None:
        self.sent: list[tuple[float, SafeSetpoint]] = []

    def __call__(self, safe: SafeSetpoint, now_s: float) -> None:
        self.sent.append((now_s, safe))


class Hand:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_it_holds_after_half_a_second_and_is_silent_after_three() -> None:
    clock, wire = Hand(), Wire()
    man = DeadMan(clock, wire)
    man.feed([sealed(1).at_rest("stalled"), sealed(2).at_rest("stalled")])
    for tick in range(60):
        clock.now_s = 0.1 * tick
        man.step()
    times = sorted({now_s for now_s, _ in wire.sent})
    assert times[0] == pytest.approx(HOLD_AFTER_S + 0.1, abs=0.051)
    assert times[-1] < SILENT_AFTER_S
    assert all(safe.setpoint.vel_ned_mps == (0.0, 0.0, 0.0) and safe.passed_gate for _, safe in wire.sent)
    assert {safe.setpoint.system_id for _, safe in wire.sent} == {1, 2}
    assert man.feed([]) > HOLD_AFTER_S
    assert man.feed([]) == 0.0


def test_a_loop_that_ticks_is_left_alone() -> None:
    clock, wire = Hand(), Wire()
    man = DeadMan(clock, wire)
    for tick in range(100):
        clock.now_s = 0.1 * tick
        man.feed([sealed()])
        assert not man.step()
    assert not wire.sent


def test_it_keeps_its_hands_off_while_the_link_is_in_use() -> None:
    clock, wire = Hand(), Wire()
    man = DeadMan(clock, wire)
    man.feed([sealed()])
    clock.now_s = 1.0
    with man.hands:
        assert not man.step()
    assert man.step()


def test_its_thread_watches_a_loop_that_really_stalls() -> None:
    sent = threading.Event()
    clock = Hand()
    man = DeadMan(clock, lambda safe, now_s: sent.set())
    man.watch()
    man.feed([sealed()])
    clock.now_s = 1.0  # and nobody ticks
    assert sent.wait(10.0)
    man.end()


def test_a_mission_that_fails_once_holds_and_goes_on() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    step, failures = flight.manager.step, iter([True] * 10)

    def failing(now_s: float) -> list[SealedSetpoint]:
        if next(failures, False):
            raise ZeroDivisionError("a defect")
        return step(now_s)

    flight.manager.step = failing  # type: ignore[method-assign]
    flight.loop.tick()
    assert flight.vehicles[0].command == (0.0, 0.0, 0.0)
    assert flight.journal.kinds().count("loop.failed") == 1
    flight.until_state(CampaignState.DONE)


def test_a_mission_that_goes_on_failing_falls_silent_and_the_vehicles_own_failsafes_fly() -> None:
    flight = Flight()
    for vehicle in flight.vehicles:
        vehicle.leaves_offboard = True
    flight.start()
    begun_s = flight.until_slot(1).time_s

    def failing(now_s: float) -> list[SealedSetpoint]:
        raise ZeroDivisionError("a defect")

    flight.manager.step = failing  # type: ignore[method-assign]
    flushes = flight.fleet.flushes
    flight.loop.run(until=lambda s: s.time_s > begun_s + FAILING_HELD_S)
    assert flight.fleet.flushes == flushes, "nothing vouches for it"
    assert all(math.hypot(*vehicle.vel[:2]) < 0.5 for vehicle in flight.vehicles)
    assert all(vehicle.mode is FlightMode.GUIDED for vehicle in flight.vehicles)
    sent = len(flight.fleet.sent)
    flight.loop.run(until=lambda s: s.time_s > begun_s + FAILING_HELD_S + 4.0)
    assert len(flight.fleet.sent) <= sent + 4
    assert all(vehicle.mode_name == "POSCTL" for vehicle in flight.vehicles)
    assert flight.journal.kinds().count("loop.failed") == 1
