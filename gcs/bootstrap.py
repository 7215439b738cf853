"""The one place that wires ground control's parts together."""

import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gcs.api.settings import server_version
from gcs.flight_loop import FlightLoop
from gcs.mission.manager import MissionManager
from gcs.mission.order import CampaignOrder, FlightSettings
from gcs.mission.threaded_planner import ThreadedPlanner
from gcs.ports import FleetLink, FlightClock, Journal, OperatorRequest, Planner, UserPlaces
from gcs.safety.gate import compile_rules
from policy.agents.base import Agent
from policy.agents.registry import PolicyChoice
from policy.evaluation.evaluate import policy_of
from policy.mission_file import Mission, open_campaign
from policy.mobility.feed import TraceFeed
from policy.mobility.traces import UserTraces
from policy.model.checkpoint import find_checkpoint, read_card
from policy.model.checkpoint_error import CheckpointError
from policy.model.files import sha256
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario

LiveUsers = Callable[[OperatorRequest, Scenario], tuple[Scenario, tuple[str, ...], UserPlaces]]
"""Users who report themselves: the scenario with their rates, their ids and their places."""


class CampaignUsers:
    """ports.UserPlaces over a trace that reveals itself slot by slot."""

    def __init__(self, traces: UserTraces) -> None:
        self._places = TraceFeed(traces).as_places()
        self.num_users = traces.num_users

    def positions(self, sample: int) -> FloatArray:
        """[M, 2] at ``sample``: reached already, or the next one."""
        return self._places.positions(sample)


@dataclass(frozen=True)
class Cast:
    """Who flies and who decides."""

    system_ids: tuple[int, ...]
    policy: PolicyChoice
    agent: Agent | None = None  # made already, to find a bad checkpoint before take-off
    policy_url: str | None = None  # decide at `policy serve` instead of in this process
    seed: int = 0


def make_planner(cast: Cast, campaign_id: str) -> Planner:
    """A planner in its own thread, asking an agent of this process or a service elsewhere."""
    if cast.policy_url is not None:
        from gcs.mission.port_agent import PortAgent  # noqa: PLC0415 - an HTTP client, for this choice only
        from policy.service.client import RemotePolicy  # noqa: PLC0415

        remote = RemotePolicy(cast.policy_url)
        bare = PolicyChoice(cast.policy.name)  # weights are the service's own
        return ThreadedPlanner(lambda: PortAgent(remote, campaign_id, bare))
    agent = cast.agent
    return ThreadedPlanner(cast.policy.build if agent is None else lambda: agent)


def provenance(cast: Cast) -> dict[str, str]:
    """For the log: this version, and the digest of a learned policy's weights or the address of a service's."""
    known = {"version": server_version()}
    if cast.policy_url is not None:
        return known | {"policy_url": cast.policy_url}
    return known | {"weights_sha256": weights_digest(cast.policy)}


def weights_digest(choice: PolicyChoice) -> str:
    """SHA-256 of a learned policy's weights, empty for one that has none or whose weights cannot be read (yet)."""
    try:
        if choice.name == "gcrl":
            return str(read_card(find_checkpoint(choice.checkpoint))["sha256"]["onnx"])
        return "" if choice.checkpoint is None else sha256(Path(choice.checkpoint))
    except (CheckpointError, KeyError, OSError):  # the policy itself will say so when it is built
        return ""


def make_order(
    mission: Mission,
    cast: Cast,
    *,
    campaign_id: str | None = None,
    settings: FlightSettings | None = None,
    live: Callable[[Scenario], tuple[Scenario, tuple[str, ...], UserPlaces]] | None = None,
) -> CampaignOrder:
    """Read the users and make the planner. Raises MissionError and the policy's own errors, one line each."""
    scenario, traces = open_campaign(mission)
    places: UserPlaces
    if traces is not None:
        user_ids, places = traces.user_ids, CampaignUsers(traces)
    elif live is not None:
        scenario, user_ids, places = live(scenario)
    else:
        mission.source.fail(("users", "source"), "is live: fly this mission from the server, which takes users' fixes")
    campaign_id = campaign_id or uuid.uuid4().hex[:12]
    return CampaignOrder(
        campaign_id=campaign_id,
        name=mission.name,
        policy=cast.policy.name,
        scenario=scenario,
        user_ids=user_ids,
        places=places,
        planner=make_planner(cast, campaign_id),
        system_ids=cast.system_ids,
        seed=cast.seed,
        settings=settings or FlightSettings(),
        provenance=provenance(cast),
    )


def make_loop(
    clock: FlightClock,
    link: FleetLink,
    journal: Journal,
    prepare: Callable[[OperatorRequest], CampaignOrder] | None = None,
) -> FlightLoop:
    """Manager and loop over a clock and a link."""
    compile_rules()  # seconds on a cold cache: never while anything flies
    manager = MissionManager(link, journal, virtual=clock.is_virtual)
    return FlightLoop(clock, link, manager, journal, prepare)


def make_preparer(
    system_ids: Sequence[int], *, policy_url: str | None = None, live: LiveUsers | None = None
) -> Callable[[OperatorRequest], CampaignOrder]:
    """For a server: turns START requests into orders, with the first drones of the fleet."""

    def prepare(request: OperatorRequest) -> CampaignOrder:
        mission = request.mission
        if mission is None:
            raise ValueError("a start needs a mission")
        wanted = mission.scenario.num_uavs
        if wanted > len(system_ids):
            raise ValueError(f"mission {mission.name!r} needs {wanted} drones; this server has {len(system_ids)}")
        cast = Cast(tuple(system_ids[:wanted]), policy_of(mission), policy_url=policy_url)
        users = None if live is None else (lambda scenario: live(request, scenario))
        return make_order(mission, cast, campaign_id=request.campaign_id, live=users)

    return prepare
