"""What a restarted server does with the campaigns that were in the air when the one before it ended."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from gcs.flight_loop import FlightLoop
from gcs.mission.order import CampaignOrder
from gcs.mission.resume import Resumption, check_resumption
from gcs.mission.threaded_planner import Answer
from gcs.ports import (
    CampaignState,
    Checkpoint,
    Event,
    FlightClock,
    OperatorRequest,
    PlanFailure,
    RequestKind,
    Severity,
    SlotRecord,
)
from gcs.store.records import CampaignRecord
from gcs.store.store import Store
from policy.mission_file import Mission, MissionError, parse_mission
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario
from policy.world.state import WorldState

Prepare = Callable[[OperatorRequest], CampaignOrder]
BringBack = Callable[[CampaignRecord, Mission, tuple[SlotRecord, ...]], None]
"""Hands the places of live users back to who keeps them."""


@dataclass(frozen=True)
class Restart:
    """Everything needed to take campaigns up: records, the loop (not running yet), and how to prepare a start."""

    store: Store
    loop: FlightLoop
    clock: FlightClock
    prepare: Prepare
    speedup: float
    bring_back: BringBack

    def run(self) -> None:
        """The newest campaign in the air is taken up; others cannot have been, and are closed."""
        if self.store.checkpoints.stop_latched():
            self.loop.latch_stop()
        for system_id in self.store.checkpoints.stopped_ones():
            self.loop.latch_stop(system_id)
        unfinished = sorted(self.store.campaigns.unfinished(), key=lambda record: record.updated_at)
        for record in unfinished[:-1]:
            close(self.store, record, f"the server ended while it was {record.state}, and another one flew later")
        if unfinished:
            self._take_up(unfinished[-1])

    def _take_up(self, record: CampaignRecord) -> None:
        found = self.store.checkpoints.of(record.id)
        if found is None:
            close(self.store, record, f"the server ended while it was {record.state}, before a drone was ordered")
            return
        checkpoint, taken_at = found
        away_s = max(0.0, (datetime.now(UTC) - taken_at).total_seconds()) * self.speedup
        resumption = Resumption(checkpoint, tuple(self.store.slots.of(record.id)), self.clock.now_s() - away_s)
        try:
            mission = _mission(record)
        except MissionError as error:  # no area, no way home that could be judged
            close(self.store, record, f"the server ended while it was {record.state}; {error}")
            return
        try:
            self.bring_back(record, mission, resumption.records)
            order = self.prepare(OperatorRequest(RequestKind.START, "system", record.id, mission))
            order = replace(order, seed=checkpoint.seed)
            check_resumption(resumption, order)
        except ValueError as error:
            resumption = replace(resumption, going_home=f"it cannot go on after the restart: {error}")
            order = _homebound(record, mission.scenario, checkpoint, resumption.records)
        self.loop.take_up(order, resumption)


def close(store: Store, record: CampaignRecord, reason: str) -> None:
    """A campaign that nobody flies any more."""
    store.campaigns.set_state(record.id, record.state, CampaignState.FAILED, reason)
    store.journal.record(Event(0.0, "campaign.interrupted", reason, Severity.WARNING, record.id))


def _mission(record: CampaignRecord) -> Mission:
    directory = None if record.directory is None else Path(record.directory)
    return parse_mission(record.document, origin=f"campaign {record.id}", directory=directory)


def _homebound(
    record: CampaignRecord, scenario: Scenario, checkpoint: Checkpoint, records: tuple[SlotRecord, ...]
) -> CampaignOrder:
    """Enough of an order to bring the drones home: nobody decides, users stay where they were."""
    users = records[-1].users if records else ()
    scenario = replace(scenario, collect_mbps=np.resize(scenario.collect_mbps, len(users)))
    places = LastPlaces(np.array([(user.east_m, user.north_m) for user in users]).reshape(-1, 2))
    return CampaignOrder(
        campaign_id=record.id,
        name=record.name,
        policy=record.policy,
        scenario=scenario,
        user_ids=tuple(user.user_id for user in users),
        places=places,
        planner=NoPlanner(),
        system_ids=tuple(drone.system_id for drone in checkpoint.drones),
        seed=checkpoint.seed,
    )


@dataclass(frozen=True)
class LastPlaces:
    """ports.UserPlaces of people who stay where they were last."""

    pos_enu_m: FloatArray

    @property
    def num_users(self) -> int:
        """M."""
        return int(self.pos_enu_m.shape[0])

    def positions(self, sample: int) -> FloatArray:
        """[M, 2], whatever the sample."""
        return self.pos_enu_m


class NoPlanner:
    """ports.Planner that decides nothing: the drones hold."""

    def begin(self, scenario: Scenario, seed: int) -> None:
        """Nothing to load."""

    def request(self, state: WorldState) -> Answer:
        """No decision, at once."""
        answer = Answer()
        answer.settle(PlanFailure("the campaign is only brought home"))
        return answer

    def close(self) -> None:
        """Nothing to end."""
