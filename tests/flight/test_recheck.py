"""A flown campaign's decisions made again from the store: bit for bit, and where another policy would differ."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fake_fleet import FakeFleet, FakeVehicle

from gcs.__main__ import main
from gcs.bootstrap import Cast, make_order
from gcs.flight_loop import FlightLoop
from gcs.mission.manager import MissionManager
from gcs.mission.resume import Resumption
from gcs.ports import CampaignState
from gcs.recheck.decisions import RecheckError, recheck, world_state
from gcs.store.reasons import kept_reasons
from gcs.store.store import Store, open_store
from policy.agents.base import Decision
from policy.agents.registry import PolicyChoice
from policy.mission_file import Mission, parse_mission
from policy.world.state import JointAction, WorldState

SLOTS = 5


def mission(policy: str) -> Mission:
    return parse_mission(
        {
            "campaign": {"name": "again", "slots": SLOTS, "slot_s": 15.0},
            "area": {"south_west": [40.42, -86.93], "size_m": [1600.0, 1400.0]},
            "fleet": {"uavs": 2, "altitude_m": 60.0, "max_speed_mps": 15.0, "launch_m": [800.0, 700.0]},
            "users": {"source": "walkers", "count": 12},
            "policy": {"name": policy},
        }
    )


def fly(store: Store, policy: str, *, killed_in_slot: int | None = None) -> str:
    """A whole campaign in virtual time over the real store; if wanted with a restart on the way."""
    flown = mission(policy)
    record = store.campaigns.create(flown, "tester")
    vehicles = [FakeVehicle(i + 1, 800.0 + 4.0 * i, 700.0) for i in range(2)]
    fleet = FakeFleet(flown.scenario.area.frame, vehicles, is_virtual=True)
    order = make_order(flown, Cast((1, 2), PolicyChoice(policy)), campaign_id=record.id)
    manager = MissionManager(fleet, store.journal, virtual=True)
    loop = FlightLoop(fleet, fleet, manager, store.journal)
    loop.run(until=lambda s: s.time_s > 0.5)
    loop.start(order)
    if killed_in_slot is not None:
        loop.run(until=lambda s: s.campaign is not None and s.campaign.slot >= killed_in_slot)
        assert store.journal.flush(20.0)
        order.planner.close()
        found = store.checkpoints.of(record.id)
        assert found is not None
        order = make_order(flown, Cast((1, 2), PolicyChoice(policy)), campaign_id=record.id)
        manager = MissionManager(fleet, store.journal, virtual=True)
        loop = FlightLoop(fleet, fleet, manager, store.journal)
        loop.take_up(order, Resumption(found[0], tuple(store.slots.of(record.id)), fleet.now_s()))
    loop.run(until=lambda s: s.campaign is not None and s.campaign.state in {CampaignState.DONE, CampaignState.FAILED})
    assert loop.snapshot().campaign.state is CampaignState.DONE
    assert store.journal.flush(20.0)
    return record.id


@pytest.fixture
def kept(tmp_path: Path):  # type: ignore[no-untyped-def]
    store = open_store(f"sqlite:///{tmp_path / 'again.db'}")
    yield store
    store.close()


def url(store: Store) -> str:
    return store.engine.url.render_as_string(hide_password=False)


@pytest.mark.parametrize("policy", ["gcrl", "receding-horizon", "random"])
def test_the_same_policy_decides_bit_for_bit_the_same(
    kept: Store, policy: str, capsys: pytest.CaptureFixture[str]
) -> None:
    campaign = fly(kept, policy)
    assert len(kept.checkpoints.decisions(campaign)) == SLOTS
    assert main(["recheck", campaign, "--store", url(kept)]) == 0
    assert "bit for bit the same" in capsys.readouterr().out
    check_reasons(kept, campaign, policy)


def check_reasons(kept: Store, campaign: str, policy: str) -> None:
    """Those on record are those that the policy gives for that decision; whom it attends to, gcrl alone can say."""
    decisions, slots = kept.checkpoints.decisions(campaign), kept.slots.of(campaign)
    agent, first = PolicyChoice(policy).build(), decisions[0]
    scenario = replace(mission(policy).scenario, max_speed_mps=first.max_speed_mps)
    agent.reset(scenario.with_accel(first.max_accel_mps2), first.seed)
    for decision in decisions:
        again = agent.decide(world_state(decision, slots[decision.slot])).explanation
        assert decision.explanation == json.loads(json.dumps(kept_reasons(again)))
        assert decision.time_s == pytest.approx(slots[decision.slot].time_s, abs=0.11)  # a tick
    told = [uav for decision in decisions for uav in (decision.explanation or {})["uavs"]]
    assert any(uav["relations"] for uav in told) == (policy == "gcrl")


@pytest.mark.parametrize("policy", ["receding-horizon", "random"])
def test_a_restart_begins_the_policy_anew_and_both_parts_are_made_again(kept: Store, policy: str) -> None:
    campaign = fly(kept, policy, killed_in_slot=2)
    decisions = kept.checkpoints.decisions(campaign)
    assert len({decision.session for decision in decisions}) == 2
    result = recheck(mission(policy).scenario, kept.slots.of(campaign), decisions, PolicyChoice(policy).build)
    assert (result.sessions, result.decisions, result.differences) == (2, len(decisions), ())


def test_another_policy_is_told_slot_by_slot(kept: Store, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    campaign = fly(kept, "receding-horizon")
    out = tmp_path / "differences.json"
    assert main(["recheck", "--store", url(kept), "--policy", "random", "--json", str(out)]) == 1
    told = capsys.readouterr().out
    assert campaign in told
    assert "slot 0, UAV" in told
    assert "random differs in" in told
    assert '"slots": [' in out.read_text(encoding="utf-8")


def test_one_bit_is_a_difference(kept: Store) -> None:
    campaign = fly(kept, "random")
    decisions = list(kept.checkpoints.decisions(campaign))
    nudged = decisions[3].heading_rad[1] + math.ulp(decisions[3].heading_rad[1] or 1.0)
    decisions[3] = replace(decisions[3], heading_rad=(decisions[3].heading_rad[0], nudged))
    result = recheck(mission("random").scenario, kept.slots.of(campaign), decisions, PolicyChoice("random").build)
    assert [(one.slot, one.uav) for one in result.differences] == [(3, 1)]


class Counting:
    """An agent whose answer tells how often it was asked: it must be asked in order, and never too often."""

    name = "counting"

    def reset(self, scenario: object, seed: int) -> None:
        self.asked = 0

    def decide(self, state: WorldState) -> Decision:
        self.asked += 1
        count = state.uav_pos_enu_m.shape[0]
        return Decision(JointAction(np.full(count, 0.1 * self.asked), np.full(count, 1.0)))


def test_decisions_that_came_too_late_are_made_again_too(kept: Store) -> None:
    campaign = fly(kept, "random")
    decisions = [
        replace(one, heading_rad=(0.1 * (i + 1),) * 2, speed_mps=(1.0, 1.0), flown=i != 2)
        for i, one in enumerate(kept.checkpoints.decisions(campaign))
    ]
    make: Callable[[], Counting] = Counting
    assert not recheck(mission("random").scenario, kept.slots.of(campaign), decisions, make).differences
    del decisions[2]
    assert recheck(mission("random").scenario, kept.slots.of(campaign), decisions, make).slots == (3, 4)


def test_what_cannot_be_checked_is_told(kept: Store, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["recheck", "--store", url(kept)]) == 2
    assert "no campaign was flown" in capsys.readouterr().err
    assert main(["recheck", "nobody", "--store", url(kept)]) == 2
    campaign = fly(kept, "random")
    decision = kept.checkpoints.decisions(campaign)[0]
    with pytest.raises(RecheckError, match="slot 0 is not"):
        world_state(decision, None)
    gone = replace(kept.slots.of(campaign)[0])
    wiped = replace(gone, users=tuple(replace(user, east_m=math.nan, north_m=math.nan) for user in gone.users))
    with pytest.raises(RecheckError, match="privacy"):
        world_state(decision, wiped)
    with pytest.raises(RecheckError, match="older version"):
        recheck(mission("random").scenario, [gone], [replace(decision, max_speed_mps=math.nan)], Counting)
