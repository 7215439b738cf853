"""Changes of state and of hands: in the log before anything comes of them, and never beyond what they are about."""

from dataclasses import dataclass, field

import pytest

from gcs.mission.campaign import Campaign
from gcs.mission.campaign_log import CampaignLog
from gcs.mission.changes import Changes
from gcs.mission.drone import Control
from gcs.mission.order import CampaignOrder
from gcs.mission.states import IllegalTransitionError, Trigger
from gcs.mission.watch import DropOut, Fate
from gcs.ports import CampaignState, Checkpoint, CommandKind, Event, UavTrack, VehicleCommand, VehicleStatus
from policy.mission_file import load_mission

SCENARIO = load_mission("demo").scenario
UAVS = SCENARIO.num_uavs


@dataclass
class Witness:
    """Journal and link in one: what was recorded, kept, waited for and sent, in its order."""

    acts: list[str] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)

    def record(self, event: Event) -> None:
        self.events.append(event)
        self.acts.append(event.kind)

    def checkpoint(self, checkpoint: Checkpoint) -> None:
        self.acts.append(f"kept {checkpoint.state}")

    def settle(self) -> bool:
        self.acts.append("settled")
        return True

    def submit(self, command: VehicleCommand, now_s: float) -> None:
        self.acts.append(f"sent {command.kind}")


@pytest.fixture
def witness() -> Witness:
    return Witness()


@pytest.fixture
def changes(witness: Witness) -> Changes:
    return Changes(witness, CampaignLog(witness))  # type: ignore[arg-type]


@pytest.fixture
def campaign() -> Campaign:
    """In its slots, everyone flown by us."""
    order = CampaignOrder("c1", "test", "random", SCENARIO, (), None, None, tuple(range(1, UAVS + 1)))  # type: ignore[arg-type]
    flown = Campaign(order, {})
    flown.state = CampaignState.FLYING
    for drone in flown.drones:
        drone.control, drone.active = Control.GUIDED, True
        drone.status = VehicleStatus(drone.system_id, "px4", armed=True)
        drone.track = UavTrack(drone.system_id, 100.0, 100.0, drone.layer_alt_m, 0.0, 0.0, 0.0, 0.0, 0.0)
    return flown


def test_a_change_of_state_is_kept_before_anything_comes_of_it(
    changes: Changes, witness: Witness, campaign: Campaign
) -> None:
    changes.move(campaign, Trigger.PAUSE, actor="ann")
    assert witness.acts == ["campaign.state", "kept paused", "settled"]
    assert (witness.events[0].message, witness.events[0].actor) == ("flying -> paused", "ann")


def test_a_change_that_the_state_forbids_is_a_defect(changes: Changes, witness: Witness, campaign: Campaign) -> None:
    with pytest.raises(IllegalTransitionError, match="flying"):
        changes.move(campaign, Trigger.RESUME)
    assert campaign.state is CampaignState.FLYING
    assert not witness.acts


def test_a_fault_of_all_brings_everyone_down(changes: Changes, campaign: Campaign) -> None:
    changes.fail(campaign, "no wind, no drones")
    assert (campaign.state, campaign.reason) == (CampaignState.RECOVERING, "no wind, no drones")
    assert not any(drone.active or drone.script.finished for drone in campaign.drones)


def test_one_that_drops_out_leaves_the_rest_to_go_on(changes: Changes, campaign: Campaign) -> None:
    first, *rest = campaign.drones
    changes.drop(campaign, first, DropOut(Fate.RELEASE, "a pilot took it"))
    assert (first.control, first.active, first.reason) == (Control.RELEASED, False, "a pilot took it")
    assert campaign.state is CampaignState.FLYING
    assert all(drone.active for drone in rest)


def test_the_last_one_that_drops_out_ends_the_flight(changes: Changes, campaign: Campaign) -> None:
    for drone in campaign.drones:
        changes.drop(campaign, drone, DropOut(Fate.GO_HOME, "low battery"))
    assert campaign.state is CampaignState.RECOVERING
    assert "no drone is left" in campaign.reason


def test_during_the_launch_one_dropout_is_the_end(changes: Changes, campaign: Campaign) -> None:
    campaign.state = CampaignState.LAUNCHING
    changes.drop(campaign, campaign.drones[0], DropOut(Fate.RELEASE, "a pilot took it"))
    assert campaign.state is CampaignState.RECOVERING
    assert campaign.reason == "drone 1: a pilot took it"


def test_a_silent_one_is_told_to_return_in_case_it_hears(
    changes: Changes, witness: Witness, campaign: Campaign
) -> None:
    campaign.drones[0].silent_s = 5.0
    changes.drop(campaign, campaign.drones[0], DropOut(Fate.RELEASE, "silent for 60 s"))
    assert "sent rtl" in witness.acts
    assert campaign.drones[0].control is Control.RELEASED


@pytest.mark.parametrize(
    ("kind", "acts"),
    [
        (CommandKind.ARM, ["command.given", "settled", "sent arm"]),
        (CommandKind.TAKEOFF, ["command.given", "settled", "sent takeoff"]),
        (CommandKind.LAND, ["command.given", "sent land"]),
    ],
)
def test_what_must_not_be_done_twice_waits_for_the_store(
    kind: CommandKind, acts: list[str], changes: Changes, witness: Witness
) -> None:
    changes.submit(VehicleCommand(kind, 1), 0.0)
    assert witness.acts == acts
