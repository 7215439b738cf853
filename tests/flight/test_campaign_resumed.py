"""A campaign that another process goes on with, in virtual time: the fleet flies on alone in between."""

import math
from dataclasses import replace

import numpy as np
import pytest
from fake_fleet import Ticket
from test_campaign import SLOTS, Flight, ScriptedPlanner, StillUsers, square

from gcs.flight_loop import FlightLoop
from gcs.mission.manager import MissionManager
from gcs.mission.resume import Resumption
from gcs.ports import CampaignState, CommandKind, FlightMode, RequestKind, VehicleCommand


def restart(flight: Flight, away_s: float, *, going_home: str = "", stopped: bool = False) -> None:
    """The process dies here; a new one is there after ``away_s`` with what the journal holds."""
    died_s = flight.fleet.now_s()
    flight.fleet.wait_until(died_s + away_s)
    was, records = flight.journal.checkpoints[-1], tuple(flight.journal.slots)
    taken_s = flight.journal.checkpoint_times_s[-1]
    flight.fleet.status.clear()
    flight.users = StillUsers()
    flight.planner = ScriptedPlanner(square)
    flight.order = replace(flight.order, places=flight.users, planner=flight.planner)
    flight.manager = MissionManager(flight.fleet, flight.journal, virtual=True)
    flight.loop = FlightLoop(flight.fleet, flight.fleet, flight.manager, flight.journal)
    if stopped:
        flight.loop.latch_stop()
    flight.loop.take_up(flight.order, Resumption(was, records, taken_s, going_home))


def check_end(flight: Flight) -> None:
    """Flown to the end, nothing missing, nobody took off twice, everyone is at home."""
    last = flight.until_state(CampaignState.DONE, CampaignState.FAILED, CampaignState.ABORTED)
    assert last.campaign is not None
    assert (last.campaign.state, last.campaign.reason) == (CampaignState.DONE, "")
    assert [record.slot for record in flight.journal.slots] == list(range(SLOTS + 1))
    energies = np.array([[uav.energy_j for uav in record.uavs] for record in flight.journal.slots])
    assert np.all(np.diff(energies, axis=0) > 0.0)
    for i, vehicle in enumerate(flight.vehicles):
        assert vehicle.commands.count(CommandKind.TAKEOFF) == 1
        assert math.hypot(vehicle.east_m - 800.0 - 4.0 * i, vehicle.north_m - 700.0) < 3.0
        assert not vehicle.armed


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("after_s", [11.0, 29.0])
def test_killed_during_the_launch(autopilot: str, after_s: float) -> None:
    flight = Flight(autopilot=autopilot)
    flight.start()
    flight.until(lambda s: s.time_s >= after_s)
    assert flight.loop.snapshot().campaign.state is CampaignState.LAUNCHING
    restart(flight, 6.0)
    check_end(flight)


@pytest.mark.parametrize(("into_slot_s", "away_s", "missed"), [(2.0, 4.0, 0), (9.0, 24.0, 2)])
def test_killed_in_a_slot_the_clock_goes_on_and_the_books_are_caught_up(
    into_slot_s: float, away_s: float, missed: int
) -> None:
    flight = Flight()
    flight.start()
    begun_s = flight.until_slot(2).time_s
    flight.until(lambda s: s.time_s >= begun_s + into_slot_s)
    slots = len(flight.journal.slots)
    restart(flight, away_s)
    flight.until(lambda s: "campaign.resumed" in flight.journal.kinds())
    resumed = next(event for event in flight.journal.events if event.kind == "campaign.resumed")
    assert len(resumed.data["missed_slots"]) == missed
    aoi = [user.aoi_slots for user in flight.journal.slots[-1].users]
    assert len(flight.journal.slots) == slots + missed
    assert max(aoi) <= slots + missed, "AoI grows by a slot a slot, watched or not"
    end_s = flight.until_state(CampaignState.RECOVERING).time_s
    assert end_s == pytest.approx(begun_s + 15.0 * (SLOTS - 2), abs=0.2), "the slot clock is the wall's"
    check_end(flight)


def test_killed_before_a_slot_that_it_had_closed_was_written() -> None:
    """The flight waits for no slot's record: what the store had not taken is closed again by who comes next."""
    flight = Flight()
    flight.start()
    begun_s = flight.until_slot(2).time_s
    assert flight.journal.slots.pop().slot == 2
    while flight.journal.checkpoints[-1].slot >= 2:
        flight.journal.checkpoints.pop(), flight.journal.checkpoint_times_s.pop()
    restart(flight, 4.0)
    flight.until(lambda s: "campaign.resumed" in flight.journal.kinds())
    resumed = next(event for event in flight.journal.events if event.kind == "campaign.resumed")
    assert resumed.data["missed_slots"] == [2]
    end_s = flight.until_state(CampaignState.RECOVERING).time_s
    assert end_s == pytest.approx(begun_s + 15.0 * (SLOTS - 2), abs=0.2), "the slot clock is the wall's"
    check_end(flight)


def test_killed_while_paused_it_stays_paused_with_its_clock_stopped() -> None:
    flight = Flight()
    flight.start()
    begun_s = flight.until_slot(1).time_s
    flight.until(lambda s: s.time_s >= begun_s + 4.0)
    assert flight.ask(RequestKind.PAUSE) == ""
    restart(flight, 60.0)
    snapshot = flight.until(
        lambda s: s.campaign is not None and not any(d.halted for d in flight.manager.campaign.drones)
    )
    flight.loop.run(until=lambda s: s.time_s > snapshot.time_s + 5.0)
    assert flight.loop.snapshot().campaign.state is CampaignState.PAUSED
    assert flight.loop.snapshot().campaign.slot_elapsed_s == pytest.approx(4.1, abs=0.3)
    assert flight.ask(RequestKind.RESUME) == ""
    check_end(flight)


@pytest.mark.parametrize("after_s", [1.0, 60.0])
def test_killed_on_the_way_home(after_s: float) -> None:
    flight = Flight()
    flight.start()
    begun_s = flight.until_state(CampaignState.RECOVERING).time_s
    flight.until(lambda s: s.time_s >= begun_s + after_s)
    landings = [vehicle.commands.count(CommandKind.LAND) for vehicle in flight.vehicles]
    restart(flight, 10.0)
    check_end(flight)
    assert all(v.commands.count(CommandKind.LAND) == 1 for v, n in zip(flight.vehicles, landings, strict=True) if n)


def test_a_drone_that_a_pilot_took_over_meanwhile_is_left_to_him() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    flight.vehicles[1].mode = FlightMode.PILOT
    given = len(flight.vehicles[1].commands)
    restart(flight, 5.0)
    last = flight.until_state(CampaignState.FAILED)
    assert "drone 2 was last seen flying at" in last.campaign.reason
    assert len(flight.vehicles[1].commands) == given
    assert not flight.journal.slots[-1].uavs[1].active


@pytest.mark.parametrize("mute", [(0,), (0, 1)])
@pytest.mark.parametrize("state", [CampaignState.LAUNCHING, CampaignState.FLYING, CampaignState.RECOVERING])
@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_drone_that_is_heard_late_after_the_restart_is_waited_for(
    autopilot: str, state: CampaignState, mute: tuple[int, ...]
) -> None:
    """A busy machine may hear nothing for longer than the first patience: nobody is given up, nobody forgotten."""
    flight = Flight(autopilot=autopilot)
    for vehicle in flight.vehicles:
        vehicle.leaves_offboard = autopilot == "px4"
    flight.start()
    begun_s = flight.until_state(state).time_s
    flight.until(lambda s: s.time_s >= begun_s + 25.0)
    for i in mute:
        flight.vehicles[i].silent = True
    restart(flight, 4.0)
    up_s = flight.fleet.now_s()
    flight.until(lambda s: s.time_s > up_s + 20.0)
    assert flight.loop.snapshot().campaign.state is state
    for i in mute:
        flight.vehicles[i].silent = False
    check_end(flight)
    assert not [event for event in flight.journal.events if event.kind == "drone.release"]


@pytest.mark.parametrize("state", [CampaignState.FLYING, CampaignState.RECOVERING])
def test_a_drone_that_is_never_heard_again_is_no_success(state: CampaignState) -> None:
    flight = Flight()
    flight.start()
    begun_s = flight.until_state(state).time_s
    flight.until(lambda s: s.time_s >= begun_s + 5.0)
    flight.vehicles[1].silent = True
    restart(flight, 5.0)
    last = flight.until_state(CampaignState.DONE, CampaignState.FAILED)
    assert last.campaign.state is CampaignState.FAILED
    assert last.campaign.reason == "drone 2 was not heard and not seen to land; it needs a pilot"
    assert not flight.vehicles[0].armed
    assert (2, CommandKind.RETURN) in [(order.system_id, order.kind) for order in flight.fleet.commands]


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_climb_that_was_cut_off_is_finished_after_the_restart(autopilot: str) -> None:
    flight = Flight(autopilot=autopilot)
    flight.start()
    flight.until(lambda s: flight.vehicles[0].alt_m > 15.0)
    flight.vehicles[0].target_alt_m = 0.0
    flight.vehicles[0].mode = FlightMode.HOLD if autopilot == "px4" else FlightMode.GUIDED
    restart(flight, 3.0)
    check_end(flight)


def test_a_campaign_that_cannot_go_on_comes_home() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    restart(flight, 5.0, going_home="its trace is gone")
    last = flight.until_state(CampaignState.FAILED)
    assert last.campaign.reason == "its trace is gone"
    assert not any(vehicle.armed for vehicle in flight.vehicles)


def test_a_latched_stop_stays_latched_until_a_person_takes_it_off() -> None:
    flight = Flight()
    flight.start()
    begun_s = flight.until_slot(1).time_s
    flight.ask(RequestKind.EMERGENCY_STOP)
    restart(flight, 5.0, stopped=True)
    flight.loop.run(until=lambda s: s.time_s > begun_s + 25.0)
    assert flight.loop.snapshot().campaign.state is CampaignState.PAUSED
    assert all(vehicle.mode is FlightMode.HOLD for vehicle in flight.vehicles)
    assert flight.ask(RequestKind.RESET_STOP) == ""
    flight.until(lambda s: not any(drone.halted for drone in flight.manager.campaign.drones))
    assert flight.ask(RequestKind.RESUME) == ""
    check_end(flight)


def test_a_stall_of_our_own_machine_is_not_taken_for_a_pilot() -> None:
    flight = Flight(is_virtual=False)
    flight.start()
    now_s = flight.until_slot(1).time_s
    flight.fleet.wait_until(now_s + 2.0)
    flight.vehicles[0].mode, flight.vehicles[0].mode_name = FlightMode.PILOT, "POSCTL"
    flight.until(lambda s: "drone.regain" in flight.journal.kinds())
    check_end(flight)


def test_a_landing_that_shows_before_its_answer_is_not_taken_for_a_pilots() -> None:
    flight = Flight()
    slow: list[tuple[Ticket, Ticket, float]] = []
    at_once = flight.fleet.submit

    def submit(command: VehicleCommand, now_s: float) -> Ticket:
        answered = at_once(command, now_s)
        if command.kind is not CommandKind.LAND:
            return answered
        slow.append((Ticket(None), answered, now_s + 1.0))  # the vehicle obeys now and answers a second later
        return slow[-1][0]

    flight.fleet.submit = submit
    flight.start()
    while flight.loop.tick().campaign.state is not CampaignState.DONE:
        for ticket, answered, due_s in slow:
            ticket.verdict = answered.verdict if flight.fleet.now_s() >= due_s else None
    assert "drone.release" not in flight.journal.kinds()
    assert not any(vehicle.armed for vehicle in flight.vehicles)


def test_a_drone_that_a_person_orders_down_before_it_is_taken_over_is_not_taken_over() -> None:
    """The others are waited for, taken over, and go on."""
    flight = Flight()
    flight.start()
    flight.until_slot(2)
    restart(flight, 1.0)
    flight.vehicles[1].silent = True
    flight.loop.tick()
    assert flight.ask(RequestKind.COMMAND, VehicleCommand(CommandKind.HOLD, 1)) == ""
    flight.vehicles[1].silent = False
    told = len(flight.vehicles[0].commands)
    last = flight.until_state(CampaignState.DONE, CampaignState.FAILED)
    assert len(flight.vehicles[0].commands) == told
    assert flight.vehicles[0].mode is FlightMode.HOLD
    assert flight.journal.slots[-1].uavs[1].active
    assert "drone 1 was last seen flying" in last.campaign.reason
