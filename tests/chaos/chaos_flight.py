"""One campaign over sockets with a mock fleet that is made to fail: what the chaos tests fly."""

import uuid
from dataclasses import replace
from pathlib import Path

from gcs.bootstrap import Cast, make_loop, make_order
from gcs.cli.flight_log import FlightLog
from gcs.cli.mock_fleet import MockOptions, mock_fleet
from gcs.clock import LockstepClock
from gcs.links.pymavlink_link import PymavlinkFleetLink
from gcs.mission.states import FINAL
from gcs.ports import CampaignState, FlightSnapshot, Planner
from policy.evaluation.evaluate import policy_of
from policy.mission_file import load_mission

LONGEST_S = 3_600.0  # of simulated time


def fly(
    flavour: str, faults: Path, slots: int, planner: Planner | None = None
) -> tuple[FlightSnapshot, FlightLog, dict[str, int]]:
    """The demo campaign with fewer slots; ends when the campaign does, or after an hour."""
    mission = load_mission("demo")
    mission = replace(mission, scenario=replace(mission.scenario, slots=slots))
    scenario = mission.scenario
    choice = policy_of(mission, "random", None)
    order = make_order(mission, Cast((1, 2), choice, choice.build()), campaign_id=uuid.uuid4().hex[:12])
    order = order if planner is None else replace(order, planner=planner)
    east_m, north_m = (float(v) for v in scenario.launch_enu_m[0])
    lat_deg, lon_deg = scenario.area.frame.to_geodetic_deg(east_m, north_m)
    options = MockOptions(2, (lat_deg, lon_deg, 186.0), flavour, ("--faults", str(faults)))
    with mock_fleet(options) as mock:
        link, clock, log = (
            PymavlinkFleetLink(list(mock.drones), mock.drones),
            LockstepClock(mock.clock, None),
            FlightLog(),
        )
        try:
            loop = make_loop(clock, link, log)
            loop.start(order, "chaos")

            def over(snapshot: FlightSnapshot) -> bool:
                campaign = snapshot.campaign
                return snapshot.time_s > LONGEST_S or (campaign is not None and campaign.state in FINAL)

            loop.run(until=over)
            return loop.snapshot(), log, loop.violations()
        finally:
            clock.close()
            link.close()


def ended_well(snapshot: FlightSnapshot) -> bool:
    """Flown to the end and everybody stands."""
    campaign = snapshot.campaign
    standing = all(not vehicle.armed for vehicle in snapshot.vehicles)
    return campaign is not None and campaign.state is CampaignState.DONE and standing
