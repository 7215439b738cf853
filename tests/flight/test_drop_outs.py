"""Drones that drop out in flight: the rest go on as well as a fresh plan for their number would.

Two flights of the same fleet over the same people: in one the planner goes on with who is left, in the other a fresh
planner that has never known the lost ones takes over in the slot after the loss.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from test_campaign import Flight, ScriptedPlanner

from gcs.bootstrap import CampaignUsers
from gcs.ports import CampaignState, FlightMode
from policy.agents.base import Agent, Decision
from policy.evaluation.evaluate import policy_of
from policy.mission_file import load_mission, open_campaign
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState

UAVS, SLOTS, LOST_AT = 4, 24, 6
TOLERANCE = 0.10


@dataclass
class Successor:
    """The planner of the whole fleet until drones are lost; then, if asked, a fresh one for those that are left."""

    fresh: bool
    scenario: Scenario | None = None
    agent: Agent | None = None
    keep: list[int] = field(default_factory=lambda: list(range(UAVS)))

    def decide(self, state: WorldState) -> Decision:
        assert self.scenario is not None
        left = [i for i in range(UAVS) if state.uav_active[i]]
        if self.agent is None or (self.fresh and left != self.keep):
            self.keep = left if self.fresh and self.agent is not None else self.keep
            self.agent = policy_of(load_mission("demo"), "receding-horizon", None).build()
            self.agent.reset(replace(self.scenario, launch_enu_m=self.scenario.launch_enu_m[self.keep]), state.slot)
        rows = self.keep
        mine = replace(
            state,
            uav_pos_enu_m=state.uav_pos_enu_m[rows],
            uav_vel_enu_mps=state.uav_vel_enu_mps[rows],
            uav_energy_j=state.uav_energy_j[rows],
            uav_active=state.uav_active[rows],
        )
        action = self.agent.decide(mine).action
        heading, speed = np.zeros(UAVS), np.zeros(UAVS)
        heading[rows], speed[rows] = action.heading_rad, action.speed_mps
        return Decision(JointAction(heading, speed))


def flown_aoi(lost: int, *, fresh: bool) -> float:
    """Mean AoI, slots, over everyone and all slots after ``lost`` drones have dropped out."""
    mission = load_mission("demo")
    launch = mission.scenario.launch_enu_m[:1].repeat(UAVS, axis=0)
    mission = replace(mission, scenario=replace(mission.scenario, slots=SLOTS, launch_enu_m=launch))
    scenario, traces = open_campaign(mission)
    assert traces is not None
    successor = Successor(fresh)
    planner = ScriptedPlanner(successor.decide)

    def begin(planned: Scenario, seed: int) -> None:
        planner.scenario = successor.scenario = planned

    planner.begin = begin  # type: ignore[method-assign]
    flight = Flight(uavs=UAVS)
    frame, origin_m = scenario.area.frame, launch[0]
    flight.fleet.frame = frame
    for index, vehicle in enumerate(flight.vehicles):
        vehicle.east_m, vehicle.north_m = float(origin_m[0]) + 4.0 * index, float(origin_m[1])
    flight.order = replace(
        flight.order, scenario=scenario, user_ids=traces.user_ids, places=CampaignUsers(traces), planner=planner
    )
    flight.start()
    flight.until_slot(LOST_AT)
    for vehicle in flight.vehicles[:lost]:
        vehicle.mode, vehicle.mode_name = FlightMode.PILOT, "ALTCTL"
    last = flight.until_state(CampaignState.DONE, CampaignState.FAILED)
    assert last.campaign is not None
    assert last.campaign.state is CampaignState.DONE
    after = flight.journal.slots[LOST_AT + 2 :]
    assert not any(uav.active for record in after for uav in record.uavs[:lost])
    assert all(uav.active for record in after for uav in record.uavs[lost:])
    return float(np.mean([user.aoi_slots for record in after for user in record.users]))


@pytest.mark.timeout(400)
@pytest.mark.parametrize("lost", [1, 2, 3])
def test_the_rest_go_on_as_a_fresh_plan_for_their_number(lost: int) -> None:
    going_on, fresh = flown_aoi(lost, fresh=False), flown_aoi(lost, fresh=True)
    print(f"{lost} of {UAVS} lost: AoI going on {going_on:.3f}, fresh plan {fresh:.3f}")
    assert going_on <= (1.0 + TOLERANCE) * fresh
