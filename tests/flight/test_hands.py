"""Whose hands a drone is in, in whole campaigns on virtual time: cut links, pilots, stops, failures."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from fake_fleet import BATTERY_J, FakeVehicle
from test_campaign import SLOTS, Flight

from gcs.mission.custody import SILENT_GIVE_UP_S
from gcs.ports import CampaignState, CommandKind, FlightMode, OperatorRequest, RequestKind, Severity, VehicleCommand

ENDED = (CampaignState.DONE, CampaignState.FAILED, CampaignState.ABORTED)


def stop(flight: Flight, kind: RequestKind, system_id: int | None = None) -> str:
    future = flight.loop.submit(OperatorRequest(kind, "tester", system_id=system_id))
    flight.loop.tick()
    outcome = future.result(timeout=0)
    return "" if outcome.accepted else outcome.reason


def all_stand(flight: Flight) -> bool:
    return not any(vehicle.armed for vehicle in flight.vehicles)


def wait(flight: Flight, seconds: float) -> None:
    end_s = flight.fleet.now_s() + seconds
    flight.loop.run(until=lambda s: s.time_s >= end_s)


# --- cut links ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", ["silent", "deaf"])
@pytest.mark.parametrize("cut_s", [1.5, 5.0, 12.0])
def test_a_cut_that_ends_offboard_is_not_taken_for_a_pilot(way: str, cut_s: float) -> None:
    flight = Flight()
    for vehicle in flight.vehicles:
        vehicle.leaves_offboard = True
    flight.start()
    flight.until_slot(2)
    wait(flight, 4.0)
    setattr(flight.vehicles[0], way, True)
    wait(flight, cut_s)
    assert flight.vehicles[0].mode_name == "POSCTL"
    setattr(flight.vehicles[0], way, False)
    last = flight.until_state(*ENDED)
    assert last.campaign is not None
    assert last.campaign.state is CampaignState.DONE
    kinds = flight.journal.kinds()
    assert "drone.regain" in kinds
    assert "drone.release" not in flight.journal.kinds()
    assert flight.journal.slots[-1].uavs[0].active
    assert all_stand(flight)


@pytest.mark.parametrize("state", [CampaignState.LAUNCHING, CampaignState.RECOVERING])
def test_a_cut_on_the_way_out_or_home_only_delays(state: CampaignState) -> None:
    flight = Flight()
    for vehicle in flight.vehicles:
        vehicle.leaves_offboard = True
    flight.start()
    flight.until_state(state)
    flight.until(lambda s: flight.vehicles[0].mode is FlightMode.GUIDED)
    wait(flight, 1.0)
    flight.vehicles[0].silent = True
    wait(flight, 5.0)
    flight.vehicles[0].silent = False
    last = flight.until_state(*ENDED)
    assert last.campaign is not None
    assert last.campaign.state is CampaignState.DONE
    assert all_stand(flight)


def test_a_drone_silent_for_a_minute_is_told_to_return_and_given_up() -> None:
    flight = Flight()
    flight.start()
    begun_s = flight.until_slot(1).time_s
    flight.vehicles[1].silent = True
    last = flight.until_state(CampaignState.FAILED)
    assert re.fullmatch(
        r"drone 2 was last seen flying at 40\.\d{6}, -86\.\d{6}, \d+ m above its home in mode GUIDED, \d+ s ago; "
        "it needs a pilot",
        last.campaign.reason,
    )
    lost = [event for event in flight.journal.events if event.kind == "campaign.state"][-1]
    assert (lost.severity, lost.data["state"]) == (Severity.WARNING, "failed")
    release = next(event for event in flight.journal.events if event.kind == "drone.release")
    assert release.time_s == pytest.approx(begun_s + 5.0 + SILENT_GIVE_UP_S, abs=1.0)
    told = [command for command in flight.fleet.commands if command.kind is CommandKind.RETURN]
    assert [(command.system_id, command.urgent) for command in told] == [(2, True)]
    assert flight.journal.slots[-1].uavs[0].active


@pytest.mark.parametrize("wish", ["last slot", "abort"])
def test_a_drone_that_was_given_up_and_is_seen_to_stand_spoils_nothing(wish: str) -> None:
    """Told to return while nothing was heard of it; the campaign waits for what is heard coming down."""
    flight = Flight()
    flight.order = replace(flight.order, scenario=replace(flight.order.scenario, slots=12))
    flight.start()
    flight.until_slot(1)
    flight.vehicles[1].silent = True
    flight.until(lambda s: "drone.release" in flight.journal.kinds())
    if wish == "abort":
        flight.ask(RequestKind.ABORT)
    flight.until_state(CampaignState.RECOVERING)
    flight.vehicles[1].silent, flight.vehicles[1].mode = False, FlightMode.RETURN
    flight.vehicles[1].east_m += 500.0  # far from home: the other one stands long before it does
    last = flight.until_state(*ENDED)
    assert last.campaign.state is (CampaignState.ABORTED if wish == "abort" else CampaignState.DONE)
    assert "needs a pilot" not in last.campaign.reason
    assert all_stand(flight)


def test_a_campaign_that_was_aborted_names_the_drone_that_it_left_up() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    flight.vehicles[1].mode, flight.vehicles[1].mode_name = FlightMode.PILOT, "ALTCTL"
    wait(flight, 1.0)
    flight.ask(RequestKind.ABORT)
    last = flight.until_state(*ENDED)
    assert last.campaign.state is CampaignState.ABORTED
    assert last.campaign.reason.startswith("aborted by the operator; ")
    assert "drone 2 was last seen flying at" in last.campaign.reason
    assert "in mode ALTCTL" in last.campaign.reason


def stopped_over_the_pads(flight: Flight) -> FakeVehicle:
    """Drone 2, which its own pilot stopped below where drone 1 comes home."""
    flight.start()
    flight.until_slot(1)
    stray = flight.vehicles[1]
    stray.mode, stray.mode_name = FlightMode.PILOT, "BRAKE"
    wait(flight, 1.0)
    stray.east_m, stray.north_m, stray.alt_m = 804.0, 700.0, 115.0
    return stray


def test_a_drone_that_cannot_land_for_one_that_hangs_below_it_says_so() -> None:
    """The lower one was sent home by an order of its own and stopped over the pads: nobody but a person moves it."""
    flight = Flight()
    stray = stopped_over_the_pads(flight)
    flight.ask(RequestKind.ABORT)
    flight.until(lambda s: "drone.waits" in flight.journal.kinds())
    wait(flight, 30.0)
    (told,) = (event for event in flight.journal.events if event.kind == "drone.waits")
    assert (told.system_id, "drone 2 is in the air below it" in told.message) == (1, True)
    assert flight.vehicles[0].alt_m > 110.0
    stray.armed, stray.alt_m = False, 0.0
    flight.until_state(*ENDED)
    assert all_stand(flight)


def test_a_drone_never_comes_down_on_one_that_hangs_below_it_however_long_that_takes() -> None:
    """After a quarter of an hour it was ordered to return by itself, which looks at nobody below."""
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    flight.fleet.add(FakeVehicle(9, 804.0, 700.0, armed=True, alt_m=110.0))
    flight.ask(RequestKind.ABORT)
    flight.until(lambda s: "drone.waits" in flight.journal.kinds())
    flight.vehicles[1].battery_j = 0.05 * BATTERY_J
    wait(flight, 1000.0)
    told = [event.message for event in flight.journal.events if event.kind == "drone.waits" and event.system_id == 2]
    assert 3 <= len(told) <= 5
    assert all("drone 9 is in the air below it" in message for message in told)
    low = [event.message for event in flight.journal.events if event.kind == "drone.battery" and event.system_id == 2]
    assert 3 <= len(low) <= 5
    assert all("waits for drone 9" in message for message in low)
    assert not any(CommandKind.RETURN in vehicle.commands for vehicle in flight.vehicles)
    assert min(vehicle.alt_m for vehicle in flight.vehicles) > 113.0
    flight.fleet.fleet[9].armed, flight.fleet.fleet[9].alt_m = False, 0.0
    flight.until_state(*ENDED)
    assert all_stand(flight)


def test_one_that_is_not_heard_any_more_is_not_waited_for_without_end() -> None:
    """It was last seen below the pad; where it is now nobody knows, and batteries end."""
    flight = Flight()
    stray = stopped_over_the_pads(flight)
    wait(flight, 1.0)
    stray.silent = True
    flight.ask(RequestKind.ABORT)
    flight.until(lambda s: not flight.vehicles[0].armed, limit_s=1500.0)
    assert CommandKind.RETURN in flight.vehicles[0].commands
    assert "took more than 900 s" in next(e.message for e in flight.journal.events if e.kind == "drone.return")


def test_a_silent_drone_serves_nobody_and_is_not_planned_for() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    flight.vehicles[1].silent = True
    flight.until_slot(3)
    assert not flight.planner.states[-1].uav_active[1]
    flight.vehicles[1].silent = False
    flight.until_slot(5)
    assert flight.planner.states[-1].uav_active[1]
    flight.until_state(CampaignState.DONE)


# --- pilots and failsafes -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("when", ["climb", "prime", "transit", "slot", "home", "landing"])
def test_a_pilot_gets_it_at_once_in_every_phase(when: str) -> None:
    flight = Flight()
    vehicle = flight.vehicles[0]
    flight.start()
    moments = {
        "climb": lambda: vehicle.mode is FlightMode.TAKEOFF and vehicle.alt_m > 30.0,
        "prime": lambda: vehicle.mode is FlightMode.HOLD and vehicle.alt_m > 100.0,
        "transit": lambda: vehicle.mode is FlightMode.GUIDED,
        "slot": lambda: (s := flight.loop.snapshot().campaign) is not None and s.slot == 2,
        "home": lambda: (s := flight.loop.snapshot().campaign) is not None and s.state is CampaignState.RECOVERING,
        "landing": lambda: vehicle.mode is FlightMode.LAND and vehicle.alt_m > 3.0,
    }
    flight.until(lambda s: moments[when]())
    vehicle.mode, vehicle.mode_name = FlightMode.PILOT, "ALTCTL"
    wait(flight, 0.3)
    sent, given = len(vehicle.setpoint_times_s), len(vehicle.commands)
    flight.until_state(*ENDED)
    wait(flight, 30.0)
    assert (len(vehicle.setpoint_times_s), len(vehicle.commands)) == (sent, given), "never fought"
    assert vehicle.mode is FlightMode.PILOT
    assert not flight.vehicles[1].armed


def test_a_pilot_who_takes_a_stopped_drone_keeps_it_after_the_reset() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    stop(flight, RequestKind.EMERGENCY_STOP)
    wait(flight, 5.0)
    vehicle = flight.vehicles[0]
    vehicle.mode, vehicle.mode_name = FlightMode.PILOT, "ALTCTL"
    wait(flight, 1.0)
    given = len(vehicle.commands)
    stop(flight, RequestKind.RESET_STOP)
    wait(flight, 10.0)
    assert flight.ask(RequestKind.RESUME) == ""
    flight.until_state(CampaignState.FAILED)
    assert len(vehicle.commands) == given
    assert vehicle.mode is FlightMode.PILOT


def test_a_vehicles_own_return_is_left_alone_and_waited_for() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(SLOTS - 1)
    vehicle = flight.vehicles[0]
    vehicle.mode = FlightMode.RETURN
    wait(flight, 0.3)
    sent, given = len(vehicle.setpoint_times_s), len(vehicle.commands)
    flight.until_state(CampaignState.DONE)
    assert "drone.follow" in flight.journal.kinds()
    assert (len(vehicle.setpoint_times_s), len(vehicle.commands)) == (sent, given)
    assert all_stand(flight), "the campaign ended when it stood"


# --- emergency stop -----------------------------------------------------------------------------------------------


def test_one_drone_is_stopped_and_the_others_go_on() -> None:
    flight = Flight(uavs=3)
    flight.start()
    flight.until_slot(1)
    flight.vehicles[1].stubborn = 2
    assert stop(flight, RequestKind.EMERGENCY_STOP, 2) == ""
    wait(flight, 12.0)
    last = flight.loop.snapshot()
    assert last.stopped_ids == (2,)
    assert not last.stopped
    assert flight.vehicles[1].mode is FlightMode.HOLD, "told again until it obeyed"
    urgent = [command for command in flight.fleet.commands if command.kind is CommandKind.HOLD]
    assert [(command.system_id, command.urgent) for command in urgent] == [(2, True)] * 3
    flight.until_slot(3)
    assert math.hypot(*flight.vehicles[1].vel[:2]) < 0.5
    assert flight.planner.states[-1].uav_active.tolist() == [True, False, True]
    assert "latched" in flight.ask(RequestKind.COMMAND, VehicleCommand(CommandKind.GUIDED, 2))
    assert stop(flight, RequestKind.RESET_STOP, 2) == ""
    flight.until_slot(5)
    assert flight.planner.states[-1].uav_active.tolist() == [True, True, True], "it takes part again"
    flight.until_state(CampaignState.DONE)
    assert all_stand(flight)


def test_a_stopped_drone_holds_until_a_person_says_so_even_when_the_campaign_is_over() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(SLOTS - 1)
    stop(flight, RequestKind.EMERGENCY_STOP, 1)
    flight.until(lambda s: not flight.vehicles[1].armed)
    wait(flight, 60.0)
    assert flight.vehicles[0].mode is FlightMode.HOLD
    assert flight.loop.snapshot().campaign.state is CampaignState.RECOVERING
    stop(flight, RequestKind.RESET_STOP, 1)
    flight.until_state(CampaignState.DONE)
    assert all_stand(flight)


def test_a_stopped_drone_in_the_launch_brings_the_others_home() -> None:
    flight = Flight()
    flight.start()
    flight.until(lambda s: flight.vehicles[0].mode is FlightMode.GUIDED)
    stop(flight, RequestKind.EMERGENCY_STOP, 1)
    flight.until(lambda s: not flight.vehicles[1].armed)
    assert flight.vehicles[0].armed
    stop(flight, RequestKind.RESET_STOP, 1)
    last = flight.until_state(CampaignState.FAILED)
    assert "stopped during the launch" in last.campaign.reason
    assert all_stand(flight)


def test_a_stop_that_interrupts_a_landing_and_a_way_home_is_followed_by_both() -> None:
    flight = Flight(uavs=3)
    flight.order = replace(flight.order, scenario=replace(flight.order.scenario, slots=16))
    flight.start()
    flight.until_slot(2)
    for vehicle in flight.vehicles[:2]:
        vehicle.battery_j = 0.11 * 359_640.0
    flight.until(lambda s: any(vehicle.mode is FlightMode.LAND for vehicle in flight.vehicles))
    assert FlightMode.GUIDED in {vehicle.mode for vehicle in flight.vehicles[:2]}, "one lands, one is on its way"
    assert flight.loop.snapshot().campaign.state is CampaignState.FLYING
    stop(flight, RequestKind.EMERGENCY_STOP)
    wait(flight, 20.0)
    stop(flight, RequestKind.RESET_STOP)
    wait(flight, 10.0)
    assert flight.ask(RequestKind.RESUME) == ""
    flight.until_state(CampaignState.DONE)
    assert all_stand(flight)
    assert "drone.lost" not in flight.journal.kinds()


def test_a_yes_that_its_heartbeats_do_not_show_is_not_believed() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    stop(flight, RequestKind.EMERGENCY_STOP)
    wait(flight, 2.0)
    flight.vehicles[0].mode = FlightMode.GUIDED  # it said yes, and flies on
    told = flight.vehicles[0].commands.count(CommandKind.HOLD)
    wait(flight, 6.0)
    assert flight.vehicles[0].commands.count(CommandKind.HOLD) == told + 1
    assert flight.vehicles[0].mode is FlightMode.HOLD


# --- failures of the vehicle --------------------------------------------------------------------------------------


def test_a_failed_motor_brings_it_home_slowly_and_the_rest_go_on() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(2)
    vehicle = flight.vehicles[0]
    vehicle.motors_ok = False
    wait(flight, 8.0)  # to brake
    fastest = 0.0
    while vehicle.armed:
        flight.loop.tick()
        fastest = max(fastest, math.hypot(*vehicle.vel[:2]))
    assert fastest < 6.0
    assert math.hypot(vehicle.east_m - 800.0, vehicle.north_m - 700.0) < 3.0
    flight.until_state(CampaignState.DONE)
    assert flight.journal.slots[-1].uavs[1].active


def test_without_satellites_it_holds_serves_nobody_and_goes_on_when_they_are_back() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(2)
    flight.vehicles[0].satellites_ok = False
    wait(flight, 1.0)
    assert flight.vehicles[0].command == (0.0, 0.0, 0.0)
    flight.until_slot(3)
    assert not flight.journal.slots[-1].uavs[0].active
    flight.vehicles[0].satellites_ok = True
    flight.until_state(CampaignState.DONE)
    kinds = flight.journal.kinds()
    assert (kinds.count("drone.position_lost"), kinds.count("drone.position_back")) == (1, 1)
    assert flight.journal.slots[-1].uavs[0].active


# --- launch and return --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("uavs", [2, 4])
def test_own_drones_never_meet_from_the_first_arming_to_the_last_landing(autopilot: str, uavs: int) -> None:
    """All through one launch point: in the air at any two heights, they are 5 m or more apart, but on their pads."""
    flight = Flight(uavs=uavs, autopilot=autopilot)
    flight.start()
    nearest = math.inf
    while flight.loop.tick().campaign.state not in ENDED:
        air = [v for v in flight.vehicles if v.alt_m > 1.0]
        for i, first in enumerate(air):
            for second in air[i + 1 :]:
                level_m = math.hypot(first.east_m - second.east_m, first.north_m - second.north_m)
                if level_m < 5.0:
                    nearest = min(nearest, abs(first.alt_m - second.alt_m))
    assert nearest > 3.0
    assert flight.journal.states()[-1] == "done"
    starts = [v.commands.index(CommandKind.TAKEOFF) for v in flight.vehicles]
    assert len(starts) == uavs
    assert np.all(np.array([v.alt_m for v in flight.vehicles]) < 0.1)
