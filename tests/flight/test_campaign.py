"""Whole campaigns in virtual time: a real manager and loop, small real vehicles, no sockets and no sleeps."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from fake_fleet import FakeFleet, FakeVehicle, MemoryJournal

from gcs.flight_loop import FlightLoop
from gcs.mission.manager import MissionManager
from gcs.mission.order import CampaignOrder
from gcs.mission.threaded_planner import Answer
from gcs.ports import (
    CampaignState,
    CommandKind,
    FlightMode,
    FlightSnapshot,
    OperatorRequest,
    PlanFailure,
    RequestKind,
    VehicleCommand,
)
from policy.agents.base import Decision
from policy.world.arrays import FloatArray
from policy.world.energy import propulsion_power_w
from policy.world.scenario import Area, Scenario
from policy.world.state import JointAction, WorldState
from policy.world.transition import step

SLOTS = 6


@dataclass
class StillUsers:
    """Ten people who stand still; asked in order only."""

    num_users: int = 10
    asked: list[int] = field(default_factory=list)

    def positions(self, sample: int) -> FloatArray:
        assert sample <= len(set(self.asked)), "a later sample than reached"
        self.asked.append(sample)
        return np.column_stack((np.linspace(100.0, 900.0, self.num_users), np.full(self.num_users, 400.0)))


@dataclass
class ScriptedPlanner:
    """Answers at once, by a function of the state; None: never answers."""

    decide: Callable[[WorldState], Decision | PlanFailure | None]
    states: list[WorldState] = field(default_factory=list)
    scenario: Scenario | None = None
    closed: bool = False

    def begin(self, scenario: Scenario, seed: int) -> None:
        self.scenario = scenario

    def request(self, state: WorldState) -> Answer:
        self.states.append(state)
        answer, outcome = Answer(), self.decide(state)
        if outcome is not None:
            answer.settle(outcome, 1.0)
        return answer

    def close(self) -> None:
        self.closed = True


def square(state: WorldState) -> Decision:
    """Everyone flies the sides of a square, at full speed."""
    count = state.uav_pos_enu_m.shape[0]
    heading = (state.slot % 4) * math.pi / 2 + np.arange(count) * 0.3
    return Decision(JointAction(heading % (2 * math.pi), np.full(count, 15.0)))


def scenario(uavs: int = 2) -> Scenario:
    return Scenario(
        area=Area((40.42, -86.93), (1600.0, 1400.0)),
        launch_enu_m=np.tile([[800.0, 700.0]], (uavs, 1)),
        collect_mbps=np.full(10, 0.02),
        slots=SLOTS,
    )


class Flight:
    """A campaign with its fleet, ready to be flown tick by tick."""

    def __init__(
        self,
        uavs: int = 2,
        decide: Callable[[WorldState], Decision | PlanFailure | None] = square,
        autopilot: str = "px4",
        *,
        is_virtual: bool = True,
    ) -> None:
        world = scenario(uavs)
        self.vehicles = [FakeVehicle(i + 1, 800.0 + 4.0 * i, 700.0, autopilot) for i in range(uavs)]
        self.fleet = FakeFleet(world.area.frame, self.vehicles, is_virtual=is_virtual)
        self.journal, self.planner, self.users = (
            MemoryJournal(clock=self.fleet.now_s),
            ScriptedPlanner(decide),
            StillUsers(),
        )
        self.manager = MissionManager(self.fleet, self.journal, virtual=is_virtual)
        self.loop = FlightLoop(self.fleet, self.fleet, self.manager, self.journal)
        self.order = CampaignOrder(
            "c1",
            "test",
            "scripted",
            world,
            tuple(f"u{i}" for i in range(10)),
            self.users,
            self.planner,
            tuple(range(1, uavs + 1)),
        )

    def start(self) -> None:
        self.loop.run(until=lambda s: s.time_s > 0.5)
        self.loop.start(self.order)

    def until(self, test: Callable[[FlightSnapshot], bool], limit_s: float = 1500.0) -> FlightSnapshot:
        end_s = self.fleet.now_s() + limit_s
        self.loop.run(until=lambda s: test(s) or s.time_s > end_s)
        assert test(self.loop.snapshot()), f"not reached in {limit_s} s: {self.loop.snapshot().campaign}"
        return self.loop.snapshot()

    def until_state(self, *states: CampaignState) -> FlightSnapshot:
        return self.until(lambda s: s.campaign is not None and s.campaign.state in states)

    def until_slot(self, slot: int) -> FlightSnapshot:
        return self.until(lambda s: s.campaign is not None and s.campaign.slot >= slot)

    def fly(self) -> FlightSnapshot:
        self.start()
        return self.until_state(CampaignState.DONE, CampaignState.FAILED, CampaignState.ABORTED)

    def ask(self, kind: RequestKind, command: VehicleCommand | None = None) -> str:
        future = self.loop.submit(OperatorRequest(kind, "tester", command=command))
        self.loop.tick()
        self.loop.tick()
        outcome = future.result(timeout=0)
        return "" if outcome.accepted else outcome.reason


def test_no_slot_waits_for_the_store_and_none_is_told_before_it_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """A hundred drones' setpoints would wait with it; who watches waits, and a killed server closes it again."""
    flight, waits, stored = Flight(), [], 1
    monkeypatch.setattr(MemoryJournal, "settle", lambda journal: waits.append(len(journal.slots)) or True)

    def durability(journal: MemoryJournal) -> Callable[[], bool]:
        records = len(journal.slots)
        return lambda: records <= stored

    monkeypatch.setattr(MemoryJournal, "durability", durability)
    flight.start()
    flight.until(lambda s: len(flight.journal.slots) == 3)
    told = flight.loop.snapshot().campaign
    assert told is not None
    assert (told.slot, flight.manager.campaign.slots.slot) == (0, 2)
    assert set(waits) == {0}, "before the first slot the launch's orders and states were waited for"
    stored = 3
    assert flight.loop.tick().campaign.slot == 2


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_a_campaign_from_the_pads_to_the_pads(autopilot: str) -> None:
    flight = Flight(autopilot=autopilot)
    last = flight.fly()
    assert flight.journal.states() == ["launching", "flying", "recovering", "done"]
    assert last.campaign is not None
    assert last.campaign.slot == SLOTS
    assert last.campaign.metrics is not None
    assert [record.slot for record in flight.journal.slots] == list(range(SLOTS + 1))
    assert not any(v.armed for v in flight.vehicles)
    for i, vehicle in enumerate(flight.vehicles):
        assert math.hypot(vehicle.east_m - 800.0 - 4.0 * i, vehicle.north_m - 700.0) < 3.0
    assert flight.planner.closed


def test_what_every_drone_was_told_in_every_slot_is_kept() -> None:
    flight = Flight()
    flight.fly()
    kept = flight.journal.setpoints
    assert sorted(kept) == list(range(SLOTS + 2)), "before the first slot, in each, and on the way home"
    for slot in range(1, SLOTS + 1):
        assert [line.system_id for line in kept[slot]] == [1, 2]
        for line in kept[slot]:
            assert line.sent == pytest.approx(150, abs=2), "10 Hz for 15 s"
            assert line.longest_gap_s < 0.2
            assert 0.0 < line.top_speed_mps < 20.0
    on_the_wire = [len(vehicle.setpoint_times_s) for vehicle in flight.vehicles]
    in_the_books = [sum(line.sent for lines in kept.values() for line in lines if line.system_id == i) for i in (1, 2)]
    assert in_the_books == on_the_wire, "every setpoint is in one summary"


def test_slots_end_where_the_decision_says() -> None:
    flight = Flight()
    flight.fly()
    accel = flight.planner.scenario.max_accel_mps2 if flight.planner.scenario else 0.0
    assert accel == pytest.approx(0.92 * 4.5)
    for before, after in zip(flight.planner.states, flight.journal.slots[1:], strict=True):
        expected, _ = step(flight.planner.scenario, before, square(before).action, before.user_pos_enu_m)
        for uav, place in zip(after.uavs, expected.uav_pos_enu_m, strict=True):
            assert math.hypot(uav.east_m - place[0], uav.north_m - place[1]) < 10.0


def test_drones_keep_their_layers_and_the_stream_never_stops() -> None:
    flight = Flight(uavs=3)
    flight.start()
    begun_s = flight.until_state(CampaignState.FLYING).time_s
    lowest = {1: 999.0, 2: 999.0, 3: 999.0}
    while flight.loop.tick().campaign.state is CampaignState.FLYING:
        for vehicle in flight.vehicles:
            lowest[vehicle.system_id] = min(
                lowest[vehicle.system_id], abs(vehicle.alt_m - 120 + 5 * (vehicle.system_id - 1))
            )
    assert max(lowest.values()) < 2.0
    for vehicle in flight.vehicles:
        times = [t for t in vehicle.setpoint_times_s if t >= begun_s]
        assert max(np.diff(times)) < 0.2


def test_energy_is_the_worlds() -> None:
    flight = Flight(decide=lambda s: Decision(JointAction(np.zeros(2), np.zeros(2))))
    flight.fly()
    hover_j = float(propulsion_power_w(np.array(0.0))) * 15.0 * SLOTS
    assert flight.journal.slots[-1].uavs[0].energy_j == pytest.approx(hover_j, rel=0.01)


@pytest.mark.parametrize(
    ("decide", "kind"),
    [
        (lambda s: PlanFailure("no idea"), "plan.failed"),
        (lambda s: Decision(JointAction(np.full(2, np.nan), np.zeros(2))), "plan.rejected"),
        (lambda s: Decision(JointAction(np.zeros(3), np.zeros(3))), "plan.rejected"),
        (lambda s: Decision(JointAction(np.zeros(2), np.full(2, 40.0))), "plan.rejected"),
    ],
)
def test_a_bad_planner_leaves_the_drones_holding(
    decide: Callable[[WorldState], Decision | PlanFailure | None], kind: str
) -> None:
    flight = Flight(decide=decide)
    last = flight.fly()
    assert last.campaign is not None
    assert last.campaign.state is CampaignState.DONE
    assert flight.journal.kinds().count(kind) == SLOTS
    first, end = flight.journal.slots[0].uavs[0], flight.journal.slots[-1].uavs[0]
    assert math.hypot(first.east_m - end.east_m, first.north_m - end.north_m) < 2.0


def test_a_planner_that_fails_once_is_asked_again() -> None:
    flight = Flight(decide=lambda s: PlanFailure("once") if s.slot == 2 else square(s))
    flight.fly()
    assert flight.journal.kinds().count("plan.failed") == 1
    assert flight.journal.slots[3].uavs[0].speed_mps < 1.0
    assert flight.journal.slots[5].uavs[0].speed_mps > 13.0


def test_in_real_time_a_late_planner_is_given_up_after_the_grace() -> None:
    flight = Flight(decide=lambda s: None if s.slot == 1 else square(s), is_virtual=False)
    flight.start()
    at_s = flight.until_slot(1).time_s
    flight.until(lambda s: s.time_s >= at_s + 0.8)
    assert math.hypot(*flight.vehicles[0].vel[:2]) > 13.0, "goes on as before within the grace"
    flight.until(lambda s: s.time_s >= at_s + 10.0)
    assert math.hypot(*flight.vehicles[0].vel[:2]) < 1.0
    assert "plan.late" in flight.journal.kinds()
    flight.until_state(CampaignState.DONE)


def test_a_refused_arming_fails_the_campaign_in_the_vehicles_words() -> None:
    flight = Flight()
    flight.vehicles[1].refuse[CommandKind.ARM] = "Arm: compass not healthy"
    last = flight.fly()
    assert last.campaign is not None
    assert last.campaign.state is CampaignState.FAILED
    assert "compass not healthy" in last.campaign.reason
    assert flight.vehicles[1].commands.count(CommandKind.ARM) == 3
    assert not any(v.armed for v in flight.vehicles), "the first drone came down again"


def test_a_passing_refusal_is_tried_again() -> None:
    flight = Flight()
    flight.vehicles[0].refuse[CommandKind.ARM] = "Arm: gyros still settling"
    flight.vehicles[0].refusals = 2
    last = flight.fly()
    assert last.campaign is not None
    assert last.campaign.state is CampaignState.DONE


def test_a_drone_that_never_gets_ready_fails_the_launch() -> None:
    flight = Flight()
    flight.vehicles[1].ready_at_s = 1e9
    last = flight.fly()
    assert last.campaign is not None
    assert last.campaign.state is CampaignState.FAILED
    assert "drone 2: getting ready took more than 120 s" in last.campaign.reason
    assert CommandKind.ARM not in flight.vehicles[0].commands


def test_pause_holds_and_stops_the_slot_clock() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    flight.until(lambda s: s.campaign is not None and s.campaign.slot_elapsed_s > 5.0)
    assert flight.ask(RequestKind.PAUSE) == ""
    paused_s = flight.fleet.now_s()
    flight.until(lambda s: s.time_s > paused_s + 40.0)
    campaign = flight.loop.snapshot().campaign
    assert campaign is not None
    assert campaign.state is CampaignState.PAUSED
    assert campaign.slot == 1
    assert campaign.slot_elapsed_s == pytest.approx(5.2, abs=0.3)
    assert math.hypot(*flight.vehicles[0].vel[:2]) < 0.5
    assert "cannot pause" in flight.ask(RequestKind.PAUSE)
    assert flight.ask(RequestKind.RESUME) == ""
    flight.until_state(CampaignState.DONE)


@pytest.mark.parametrize("when", ["launching", "flying", "paused"])
def test_abort_brings_everyone_down(when: str) -> None:
    flight = Flight()
    flight.start()
    if when == "launching":
        flight.until(lambda s: flight.vehicles[0].alt_m > 50.0)
    else:
        flight.until_slot(2)
        flight.until(lambda s: s.campaign is not None and s.campaign.slot_elapsed_s > 7.0)
    if when == "paused":
        flight.ask(RequestKind.PAUSE)
    assert flight.ask(RequestKind.ABORT) == ""
    last = flight.until_state(CampaignState.ABORTED)
    assert not any(v.armed for v in flight.vehicles)
    assert last.campaign is not None
    assert "operator" in last.campaign.reason


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
@pytest.mark.parametrize("ticks", [1, 3, 6, 12, 20])
def test_an_abort_just_after_the_takeoff_was_ordered_leaves_nobody_in_the_air(autopilot: str, ticks: int) -> None:
    """The heartbeat that shows it armed comes up to a second later, and the first metre takes longer still."""
    flight = Flight(autopilot=autopilot)
    for vehicle in flight.vehicles:
        vehicle.slow_heartbeat = True
    flight.start()
    flight.until(lambda s: CommandKind.TAKEOFF in flight.vehicles[0].commands)
    for _ in range(ticks):
        flight.loop.tick()
    assert flight.ask(RequestKind.ABORT) == ""
    flight.until_state(CampaignState.ABORTED)
    end_s = flight.fleet.now_s() + 30.0
    flight.until(lambda s: s.time_s > end_s)
    assert not any(vehicle.armed for vehicle in flight.vehicles)
    assert "drone.lost" not in flight.journal.kinds()


def test_a_pilots_mode_change_is_respected_and_the_rest_go_on() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(2)
    flight.vehicles[0].mode = FlightMode.PILOT
    flight.until(lambda s: s.campaign is not None and s.campaign.slot_elapsed_s > 5.0)
    sent = len(flight.vehicles[0].setpoint_times_s)
    commands = len(flight.vehicles[0].commands)
    last = flight.until_state(CampaignState.FAILED)
    assert len(flight.vehicles[0].setpoint_times_s) <= sent, "never fought"
    assert len(flight.vehicles[0].commands) == commands
    assert not flight.journal.slots[-1].uavs[0].active
    assert flight.journal.slots[-1].uavs[1].active
    assert not flight.planner.states[-1].uav_active[0]
    assert last.campaign is not None


def test_a_lost_link_releases_the_drone() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(2)
    flight.vehicles[1].silent = True
    last = flight.until_state(CampaignState.FAILED)
    assert "drone 2 was last seen flying at" in last.campaign.reason
    assert any("link is lost" in e.message for e in flight.journal.events)
    assert not flight.journal.slots[-1].uavs[1].active


def test_all_drones_lost_fails_the_campaign() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    for vehicle in flight.vehicles:
        vehicle.mode = FlightMode.PILOT
    last = flight.until_state(CampaignState.FAILED)
    assert last.campaign is not None
    assert "no drone is left" in last.campaign.reason


def test_a_low_battery_goes_home_and_the_rest_go_on() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(2)
    flight.vehicles[0].battery_j = 0.11 * 359_640.0
    flight.until(lambda s: not flight.vehicles[0].armed)
    assert any(e.kind == "drone.go_home" for e in flight.journal.events)
    last = flight.until_state(CampaignState.DONE)
    assert flight.journal.slots[-1].uavs[1].active
    assert last.campaign is not None


def test_emergency_stop_latches_and_holds_everyone() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(2)
    assert flight.ask(RequestKind.EMERGENCY_STOP) == ""
    stopped_s = flight.fleet.now_s()
    last = flight.until(lambda s: s.time_s > stopped_s + 20.0)
    assert last.stopped
    assert all(v.mode is FlightMode.HOLD for v in flight.vehicles)
    assert all(math.hypot(*v.vel[:2]) < 0.5 for v in flight.vehicles)
    assert "latched" in flight.ask(RequestKind.RESUME)
    assert "latched" in flight.ask(RequestKind.COMMAND, VehicleCommand(CommandKind.GUIDED, 1))
    assert flight.ask(RequestKind.RESET_STOP) == ""
    assert "taken over" in flight.ask(RequestKind.RESUME)
    reset_s = flight.fleet.now_s()
    flight.until(lambda s: s.time_s > reset_s + 5.0)
    assert flight.ask(RequestKind.RESUME) == ""
    flight.until_state(CampaignState.DONE)
    assert all(u.active for u in flight.journal.slots[-1].uavs)


def test_a_stop_during_launch_and_recovery_still_ends_on_the_ground() -> None:
    flight = Flight()
    flight.start()
    flight.until(lambda s: flight.vehicles[0].alt_m > 60.0)
    flight.ask(RequestKind.EMERGENCY_STOP)
    flight.until(lambda s: s.time_s > 40.0)
    flight.ask(RequestKind.RESET_STOP)
    flight.until_state(CampaignState.FAILED)
    assert not any(v.armed for v in flight.vehicles)


def test_orders_to_a_campaigns_drone_release_it_or_are_refused() -> None:
    flight = Flight()
    flight.start()
    flight.until_slot(1)
    assert "flies a campaign" in flight.ask(RequestKind.COMMAND, VehicleCommand(CommandKind.DISARM, 1))
    assert flight.ask(RequestKind.COMMAND, VehicleCommand(CommandKind.LAND, 1)) == ""
    flight.until_state(CampaignState.DONE)
    assert not flight.journal.slots[-1].uavs[0].active
    assert flight.vehicles[0].commands[-1] is CommandKind.LAND


def test_no_second_campaign_at_a_time() -> None:
    flight = Flight()
    flight.start()
    with pytest.raises(Exception, match="is being flown"):
        flight.loop.start(replace(flight.order, campaign_id="c2"))


def test_unknown_trigger_needs_a_campaign() -> None:
    flight = Flight()
    assert "no campaign" in flight.ask(RequestKind.PAUSE)
