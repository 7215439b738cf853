"""What the vehicles get while a tick takes seconds, and after it: fresh setpoints or stops, never an old wish.

In virtual time: the clock goes on inside the tick that is held up, the vehicles fly meanwhile, and the dead man looks
ten times a second, as his thread would.
"""

import math
from collections.abc import Callable
from itertools import pairwise

import pytest
from fake_fleet import FakeFleet, FakeVehicle, MemoryJournal
from test_campaign import Flight
from test_flight_loop import FRAME, JumpyClock

from gcs.dead_man import HOLD_AFTER_S
from gcs.flight_loop import TICK_S, FlightLoop
from gcs.late_setpoints import LATE_S, TELL_EVERY_S, LateSetpoints
from gcs.mission.manager import MissionManager
from gcs.ports import CampaignState, FlightMode, SafeSetpoint, UavTrack, VelocitySetpoint
from gcs.safety.envelope import Envelope
from gcs.safety.gate import GateAction, SafetyGate, SealedSetpoint, Wish

STALL_S = 3.0
STOP = (0.0, 0.0, 0.0)


def moving(system_id: int = 1) -> SealedSetpoint:
    wish = VelocitySetpoint(system_id, (2.0, 1.0, 0.0), 0.3)
    track = UavTrack(system_id, 500.0 + 50.0 * system_id, 5_000.0, 60.0, 1.0, 2.0, 0.0, 0.3, 0.0)
    (made,) = SafetyGate(Envelope((10_000.0, 10_000.0))).judge([Wish(wish, track)])
    assert made.action is GateAction.PASSED
    return made


def flying(autopilot: str) -> Flight:
    flight = Flight(autopilot=autopilot)
    for vehicle in flight.vehicles:
        vehicle.leaves_offboard = autopilot == "px4"
    flight.start()
    begun_s = flight.until_slot(1).time_s
    flight.until(lambda s: s.time_s > begun_s + 9.0)
    assert all(math.hypot(*vehicle.vel[:2]) > 12.0 for vehicle in flight.vehicles), "they are on their way"
    return flight


def stall(flight: Flight) -> None:
    """The clock goes on for three seconds, and with it the vehicles and the dead man."""
    until_s = flight.fleet.now_s() + STALL_S
    while flight.fleet.now_s() < until_s - 1e-6:
        flight.fleet.wait_until(flight.fleet.now_s() + TICK_S)
        flight.loop._dead_man.step()


def once(act: Callable[[], None], before: Callable[..., object]) -> Callable[..., object]:
    """``before``, and the first time ``act`` after it."""
    acts = [act]

    def both(now_s: float) -> object:
        result = before(now_s)
        if acts:
            acts.pop()()
        return result

    return both


def told(flight: Flight, since: int) -> list[tuple[float, tuple[float, float, float]]]:
    return [(now_s, safe.setpoint.vel_ned_mps) for now_s, safe in flight.fleet.sent[since:]]


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_mission_step_of_three_seconds(autopilot: str) -> None:
    """The dead man stops the drones meanwhile; what the step had in mind at its beginning is not sent at its end."""
    flight = flying(autopilot)
    flight.manager.step = once(lambda: stall(flight), flight.manager.step)  # type: ignore
    begun_s, since = flight.fleet.now_s(), len(flight.fleet.sent)
    flight.loop.tick()
    sent = told(flight, since)
    assert {velocity for _, velocity in sent} == {STOP}
    times = sorted({now_s for now_s, _ in sent})
    assert times[0] <= begun_s + TICK_S + HOLD_AFTER_S + TICK_S + 1e-6
    assert max(b - a for a, b in pairwise(times)) < 0.25
    assert times[-1] == pytest.approx(flight.fleet.now_s())
    assert all(math.hypot(*vehicle.vel[:2]) < 8.0 for vehicle in flight.vehicles), "braked at 4.5 m/s2 for over 2 s"
    assert all(vehicle.mode is FlightMode.GUIDED for vehicle in flight.vehicles), "their stream was never cut"
    assert {"loop.stalled", "loop.late"} <= set(flight.journal.kinds())
    since = len(flight.fleet.sent)
    flight.loop.tick()
    assert {velocity for _, velocity in told(flight, since)} != {STOP}, "the next tick is fresh"
    assert flight.until_slot(3).campaign.state is CampaignState.FLYING  # type: ignore[union-attr]
    assert not any(flight.loop.violations().values())


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_poll_of_three_seconds(autopilot: str) -> None:
    """The link is in use, so nobody can send: the vehicles' own time-outs act. What it brought is three seconds old."""
    flight = flying(autopilot)
    flight.fleet.poll = once(lambda: stall(flight), flight.fleet.poll)  # type: ignore[method-assign,assignment]
    since = len(flight.fleet.sent)
    flight.loop.tick()
    sent = told(flight, since)
    assert sent, "they are told something as soon as it is over"
    assert {velocity for _, velocity in sent} == {STOP}, "a place of three seconds ago is nothing to steer by"
    assert flight.until_slot(3).campaign.state is CampaignState.FLYING  # type: ignore[union-attr]
    assert not any(flight.loop.violations().values())


def test_the_rest_of_a_fleet_is_told_to_stop_when_the_sending_itself_is_held_up() -> None:
    """Bursts of ten: the second one's wait takes half a second longer than it should."""
    clock, journal = JumpyClock([0.0, 0.0, 2.0 * LATE_S]), MemoryJournal()
    fleet = FakeFleet(FRAME, [FakeVehicle(i + 1, 0.0, 0.0) for i in range(35)], is_virtual=False)
    safe = [moving(i + 1) for i in range(35)]

    class Mover(MissionManager):
        def step(self, now_s: float) -> list[SealedSetpoint]:
            return safe

    loop = FlightLoop(clock, fleet, Mover(fleet, journal, virtual=False), journal)
    loop.tick()
    velocities = [sent.setpoint.vel_ned_mps for _, sent in fleet.sent]
    assert velocities == [(2.0, 1.0, 0.0)] * 10 + [STOP] * 25
    (event,) = [event for event in journal.events if event.kind == "loop.late"]
    assert event.message.startswith("25 setpoints were up to 0.5 s old and not sent")
    fleet.sent.clear()
    loop.tick()
    assert {sent.setpoint.vel_ned_mps for _, sent in fleet.sent} == {(2.0, 1.0, 0.0)}


def test_in_time_is_untouched_and_late_is_a_stop_that_says_why() -> None:
    late, safe = LateSetpoints(), moving()
    assert late.in_time(safe, 10.0, 10.0 + LATE_S - 1e-6) is safe
    stop: SafeSetpoint = late.in_time(safe, 10.0, 10.0 + LATE_S + 0.01)
    assert stop.passed_gate
    assert (stop.setpoint.vel_ned_mps, stop.setpoint.yaw_rad) == (STOP, safe.setpoint.yaw_rad)


def test_an_operator_is_told_at_once_and_then_every_ten_seconds() -> None:
    late, safe = LateSetpoints(), moving()
    assert late.report(0.0) == ""
    reports = []
    for tick in range(250):
        late.in_time(safe, 0.1 * tick, 0.1 * tick + 0.4)
        reports.append(late.report(0.1 * tick))
    assert [at for at, words in enumerate(reports) if words] == pytest.approx([0, 100, 200], abs=1)
    assert reports[0].startswith("1 setpoints were up to 0.4 s old")
    assert TELL_EVERY_S == 10.0
