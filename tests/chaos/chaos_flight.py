"""One campaign over sockets with a mock fleet that is made to fail: what the chaos tests fly."""

import subprocess
import sys
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from gcs.bootstrap import Cast, make_loop, make_order
from gcs.cli.flight_log import FlightLog
from gcs.cli.mock_fleet import MockOptions, free_udp_ports, mock_fleet
from gcs.clock import LockstepClock, RealClock
from gcs.flight_loop import FlightLoop
from gcs.links.opening import open_link
from gcs.mission.order import CampaignOrder
from gcs.mission.states import FINAL
from gcs.ports import CampaignState, FlightClock, FlightSnapshot, Planner
from policy.evaluation.evaluate import policy_of
from policy.mission_file import load_mission

LONGEST_S = 3_600.0  # of simulated time
GROUND_AMSL_M = 186.0


@dataclass(frozen=True)
class Chaos:
    """A short campaign and what happens to it."""

    flavour: str = "px4"
    faults: Path | None = None
    slots: int = 6
    uavs: int = 2
    altitude_m: float | None = None
    link: str = "pymavlink"
    speedup: float | None = None  # on the wall clock; None: in lock step
    seed: int = 0
    planner: Planner | None = None
    extra: tuple[str, ...] = ()


@dataclass
class Flown:
    """How it ended."""

    snapshot: FlightSnapshot
    log: FlightLog
    violations: dict[str, int]
    loop: FlightLoop = field(repr=False)

    @property
    def state(self) -> CampaignState:
        assert self.snapshot.campaign is not None
        return self.snapshot.campaign.state

    @property
    def all_stand(self) -> bool:
        return all(not vehicle.armed for vehicle in self.snapshot.vehicles)

    @property
    def breaches(self) -> int:
        return sum(self.violations.values())

    def kinds(self) -> list[str]:
        return [event.kind for event in self.log.events]

    def story(self) -> str:
        return "\n".join(f"{event.time_s:7.1f} {event.message}" for event in self.log.events)


def order_of(chaos: Chaos) -> tuple[CampaignOrder, tuple[float, float, float]]:
    """The demo campaign, shortened, and the pads' place."""
    mission = load_mission("demo")
    scenario = replace(mission.scenario, slots=chaos.slots)
    if chaos.altitude_m is not None:
        scenario = replace(scenario, altitude_m=chaos.altitude_m)
    if chaos.uavs != scenario.num_uavs:
        launch = scenario.launch_enu_m[:1].repeat(chaos.uavs, axis=0)
        scenario = replace(scenario, launch_enu_m=launch)
    mission = replace(mission, scenario=scenario)
    choice = policy_of(mission, "random", None)
    cast = Cast(tuple(range(1, chaos.uavs + 1)), choice, choice.build(), seed=chaos.seed)
    order = make_order(mission, cast, campaign_id=uuid.uuid4().hex[:12])
    order = order if chaos.planner is None else replace(order, planner=chaos.planner)
    east_m, north_m = (float(v) for v in scenario.launch_enu_m[0])
    lat_deg, lon_deg = scenario.area.frame.to_geodetic_deg(east_m, north_m)
    return order, (lat_deg, lon_deg, GROUND_AMSL_M)


def fly(chaos: Chaos) -> Flown:
    """Ends when the campaign does, or after an hour of simulated time."""
    order, home = order_of(chaos)
    with _fleet(chaos, home) as (clock, drones):
        link, log = open_link(drones, chaos.link), FlightLog()
        try:
            loop = make_loop(clock, link, log)
            loop.start(order, "chaos")

            def over(snapshot: FlightSnapshot) -> bool:
                campaign = snapshot.campaign
                return snapshot.time_s > LONGEST_S or (campaign is not None and campaign.state in FINAL)

            loop.run(until=over)
            return Flown(loop.snapshot(), log, loop.violations(), loop)
        finally:
            order.planner.close()
            link.close()


@contextmanager
def _fleet(chaos: Chaos, home: tuple[float, float, float]) -> Iterator[tuple[FlightClock, dict[int, str]]]:
    extra = (*chaos.extra, "--seed", str(chaos.seed))
    if chaos.faults is not None:
        extra += ("--faults", str(chaos.faults))
    if chaos.speedup is None:
        with mock_fleet(MockOptions(chaos.uavs, home, chaos.flavour, extra)) as mock:
            clock = LockstepClock(mock.clock, None)
            try:
                yield clock, {system_id: address for address, system_id in mock.drones.items()}
            finally:
                clock.close()
        return
    first = free_udp_ports(chaos.uavs)
    command = [sys.executable, "-m", "sitl_mock", "--count", str(chaos.uavs), "--flavour", chaos.flavour]
    command += ["--home", ",".join(f"{value:.7f}" for value in home), "--first-port", str(first)]
    command += ["--speedup", str(chaos.speedup), *extra]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            for _ in range(chaos.uavs):
                assert "ready" in process.stdout.readline()
            yield RealClock(chaos.speedup), {i + 1: f"udpout:127.0.0.1:{first + i}" for i in range(chaos.uavs)}
        finally:
            process.terminate()
