"""Orders and failures at odd moments: in a pause, in the launch, on the way home, beside a stop or other drones."""

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from fake_fleet import BATTERY_J, FakeVehicle
from test_campaign import Flight, ScriptedPlanner, square
from test_hands import ENDED, all_stand, stop, wait

from gcs.mission.drone import Control
from gcs.mission.fates import LAME_MPS
from gcs.mission.threaded_planner import Answer
from gcs.ports import CampaignState, CommandKind, FlightMode, RequestKind, Severity
from policy.world.state import WorldState


def test_a_paused_drone_whose_battery_just_brings_it_home_goes_home() -> None:
    """Nobody knows how long a pause lasts; a battery does not wait for its end."""
    flight = Flight()
    flight.start()
    flight.until_slot(2)
    assert flight.ask(RequestKind.PAUSE) == ""
    flight.vehicles[0].battery_j = 0.11 * BATTERY_J
    flight.until(lambda s: not flight.vehicles[0].armed, limit_s=300.0)
    assert flight.loop.snapshot().campaign.state is CampaignState.PAUSED
    assert flight.vehicles[1].mode is FlightMode.GUIDED
    assert flight.ask(RequestKind.RESUME) == ""
    flight.until_state(CampaignState.DONE)


def test_a_drone_that_waits_for_the_others_launch_too_long_brings_all_home() -> None:
    flight = Flight(uavs=3)
    flight.start()
    flight.until(lambda s: flight.manager.campaign.drones[0].script.finished)
    flight.vehicles[0].battery_j = 0.08 * BATTERY_J
    last = flight.until_state(*ENDED)
    assert last.campaign.state is CampaignState.FAILED
    assert "just brings it home" in last.campaign.reason
    assert all_stand(flight)


@pytest.mark.parametrize("when", ["on its way to the launch point", "on its way home"])
def test_a_motor_that_fails_before_or_after_the_slots_counts_as_well(when: str) -> None:
    flight = Flight()
    flight.order = replace(
        flight.order, scenario=replace(flight.order.scenario, launch_enu_m=flight.order.scenario.launch_enu_m + 300.0)
    )
    flight.start()
    if when == "on its way home":
        flight.until_state(CampaignState.RECOVERING)
        wait(flight, 2.0)
    else:
        flight.until(lambda s: flight.vehicles[0].east_m > 970.0)
    vehicle = flight.vehicles[0]
    vehicle.motors_ok = False
    wait(flight, 8.0)  # to brake
    fastest = 0.0
    while vehicle.armed:
        flight.loop.tick()
        fastest = max(fastest, math.hypot(*vehicle.vel[:2]))
    assert 3.0 < fastest < LAME_MPS + 1.0
    told = [e for e in flight.journal.events if e.kind == "drone.go_home" and "motor" in e.message]
    assert len(told) == 1
    flight.until_state(*ENDED)
    assert all_stand(flight)


def test_a_drone_that_fails_while_it_is_taken_back_is_taken_back_first() -> None:
    """It hangs in POSCTL: velocities home mean nothing to it before it obeys again."""
    flight = Flight()
    for vehicle in flight.vehicles:
        vehicle.leaves_offboard = True
    flight.start()
    flight.until_slot(1)
    wait(flight, 4.0)
    flight.vehicles[0].silent = True
    wait(flight, 3.0)
    flight.vehicles[0].silent = False
    flight.until(lambda s: flight.manager.campaign.drones[0].control is Control.STREAM)
    flight.vehicles[0].motors_ok = False
    flight.until(lambda s: not flight.vehicles[0].armed, limit_s=400.0)
    kinds = flight.journal.kinds()
    assert "drone.regain" in kinds
    assert "drone.go_home" in kinds
    assert "drone.return" not in kinds
    flight.until_state(CampaignState.DONE)


def test_a_campaign_goes_on_after_a_pause_though_one_drone_is_stopped() -> None:
    flight = Flight(uavs=3)
    flight.start()
    flight.until_slot(1)
    assert stop(flight, RequestKind.EMERGENCY_STOP, 2) == ""
    wait(flight, 5.0)
    assert flight.ask(RequestKind.PAUSE) == ""
    wait(flight, 5.0)
    assert flight.ask(RequestKind.RESUME) == ""
    flight.until_slot(3)
    assert flight.vehicles[1].mode is FlightMode.HOLD
    assert stop(flight, RequestKind.RESET_STOP, 2) == ""
    flight.until_state(CampaignState.DONE)
    assert all_stand(flight)


def test_one_drones_stop_is_not_taken_off_while_all_are_stopped() -> None:
    """It would be accepted and mean nothing: the drone would hold as before."""
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    stop(flight, RequestKind.EMERGENCY_STOP)
    assert "all" in stop(flight, RequestKind.RESET_STOP, 1)
    assert flight.loop.snapshot().stopped
    assert stop(flight, RequestKind.RESET_STOP) == ""


@pytest.mark.parametrize("system_id", [2, None])
def test_a_stopped_drone_whose_battery_just_brings_it_home_is_told_of_once(system_id: int | None) -> None:
    """Nobody flies it home while the stop stands: who pressed it must know in time."""
    flight = Flight(uavs=3)
    flight.start()
    flight.until_slot(1)
    assert stop(flight, RequestKind.EMERGENCY_STOP, system_id) == ""
    wait(flight, 5.0)
    assert "drone.battery" not in flight.journal.kinds()
    flight.vehicles[1].battery_j = 0.08 * BATTERY_J
    wait(flight, 20.0)
    (told,) = (event for event in flight.journal.events if event.kind == "drone.battery")
    assert (told.system_id, told.severity) == (2, Severity.WARNING)
    assert "is stopped and its battery (8%) just brings it home" in told.message
    assert flight.vehicles[1].mode is FlightMode.HOLD
    assert stop(flight, RequestKind.RESET_STOP, system_id) == ""
    wait(flight, 5.0)
    assert sum(kind == "drone.battery" for kind in flight.journal.kinds()) == 1


def test_an_abort_under_the_stop_says_what_it_waits_for() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    stop(flight, RequestKind.EMERGENCY_STOP)
    wait(flight, 2.0)
    assert flight.ask(RequestKind.ABORT) == ""
    assert "until the emergency stop is reset" in flight.loop.snapshot().campaign.reason
    wait(flight, 60.0)
    assert all(vehicle.mode is FlightMode.HOLD for vehicle in flight.vehicles)
    stop(flight, RequestKind.RESET_STOP)
    flight.until_state(CampaignState.ABORTED)
    assert all_stand(flight)


@dataclass
class LatePlanner(ScriptedPlanner):
    """Answers slot 2's first question when it is told to."""

    open: Answer | None = None

    def request(self, state: WorldState) -> Answer:
        answer = super().request(state)
        if state.slot == 2 and self.open is None:
            self.open = answer
        return answer


def test_a_plan_that_was_asked_for_before_a_pause_is_not_flown_after_it() -> None:
    """The fleet has stood still since: a reference that began before the pause would run away from it."""
    flight = Flight(is_virtual=False)
    planner = flight.planner = LatePlanner(
        lambda s: None if s.slot == 2 and flight.planner.open is None else square(s)  # type: ignore[attr-defined]
    )
    flight.order = replace(flight.order, planner=planner)
    flight.start()
    flight.until_slot(2)
    assert planner.open is not None
    assert flight.ask(RequestKind.PAUSE) == ""
    planner.open.settle(square(planner.states[-1]), 50.0)
    wait(flight, 60.0)
    at_m = (flight.vehicles[0].east_m, flight.vehicles[0].north_m)
    assert flight.ask(RequestKind.RESUME) == ""
    sent = len(flight.fleet.sent)
    flight.until_slot(3)
    assert planner.states[-2].uav_pos_enu_m[0] == pytest.approx(at_m, abs=1.0), "planned anew from where it stands"
    speeds = [math.hypot(*safe.setpoint.vel_ned_mps[:2]) for _, safe in flight.fleet.sent[sent:]]
    assert max(speeds) < 17.0, "the square's 15 m/s and what closes the loop"


def test_a_campaign_keeps_clear_of_an_own_drone_that_is_not_part_of_it() -> None:
    """Taken off by an order of its own, or left by a campaign before: it hangs where the campaign climbs to."""
    flight = Flight()
    other = FakeVehicle(9, 830.0, 700.0, armed=True, alt_m=120.0)
    flight.fleet.add(other)
    east_m = flight.order.scenario.launch_enu_m + np.array([60.0, 0.0])
    flight.order = replace(flight.order, scenario=replace(flight.order.scenario, launch_enu_m=east_m))
    flight.start()
    nearest = math.inf
    while flight.loop.tick().campaign.state is not CampaignState.FLYING and flight.fleet.now_s() < 200.0:
        for vehicle in flight.vehicles:
            if abs(vehicle.alt_m - other.alt_m) < 4.0:
                nearest = min(nearest, math.hypot(vehicle.east_m - other.east_m, vehicle.north_m - other.north_m))
    assert nearest > 8.0
    assert flight.loop.snapshot().campaign.state is CampaignState.FLYING, "and goes round it"
    assert CommandKind.HOLD not in other.commands
