"""A recorded campaign's decisions made again from their recorded inputs, and where they differ.

Everything that an agent sees is in the store: the fleet and the users of each decision, in the order in which the
policy was asked, with how it was begun. So the same policy answers bit for bit the same, and another version, other
weights or another method show in which slots they would have flown otherwise.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from gcs.ports import DecisionRecord, SlotRecord
from policy.agents.base import Agent
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState


class RecheckError(ValueError):
    """The records do not hold what a decision was made from: one line that says what is missing."""


@dataclass(frozen=True)
class Difference:
    """One UAV's part of a decision that came out otherwise; headings in rad, speeds in m/s."""

    slot: int
    uav: int  # index in the mission's order
    flown: tuple[float, float]  # heading, speed as recorded
    now: tuple[float, float]

    def words(self) -> str:
        """One line."""
        was, now = (f"{math.degrees(heading):.1f} deg {speed:.2f} m/s" for heading, speed in (self.flown, self.now))
        return f"slot {self.slot}, UAV {self.uav}: recorded {was}, now {now}"


@dataclass(frozen=True)
class Recheck:
    """``decisions`` made again in ``sessions`` beginnings of the policy."""

    decisions: int
    sessions: int
    differences: tuple[Difference, ...]

    @property
    def slots(self) -> tuple[int, ...]:
        """In which something differs."""
        return tuple(sorted({one.slot for one in self.differences}))


def recheck(
    scenario: Scenario,
    slots: Sequence[SlotRecord],
    decisions: Sequence[DecisionRecord],
    make_agent: Callable[[], Agent],
) -> Recheck:
    """Ask a fresh agent for each beginning of the policy, in the recorded order. Raises RecheckError.

    ``scenario`` as the mission file says it; what the plan counted on comes with the decisions.
    """
    if not decisions:
        raise RecheckError("no decision is recorded of this campaign")
    records, sessions = {record.slot: record for record in slots}, 0
    found: list[Difference] = []
    for _, told in groupby(decisions, key=lambda one: one.session):
        group, agent = list(told), make_agent()
        states = [world_state(decision, records.get(decision.slot)) for decision in group]
        agent.reset(_as_flown(scenario, group[0], states[0]), group[0].seed)
        for decision, state in zip(group, states, strict=True):
            found += _differences(decision, agent.decide(state).action)
        sessions += 1
    return Recheck(len(decisions), sessions, tuple(found))


def _as_flown(scenario: Scenario, first: DecisionRecord, state: WorldState) -> Scenario:
    """With as many users as there were, and the limits that the plan counted on."""
    if math.isnan(first.max_speed_mps) or math.isnan(first.max_accel_mps2):
        raise RecheckError("the decisions were recorded by an older version, without the limits they counted on")
    users = int(state.user_pos_enu_m.shape[0])
    rates = np.resize(scenario.collect_mbps, users)
    limited = replace(scenario, collect_mbps=rates, max_speed_mps=first.max_speed_mps)
    return limited.with_accel(first.max_accel_mps2)


def world_state(decision: DecisionRecord, slot: SlotRecord | None) -> WorldState:
    """What the policy was asked. Raises RecheckError when a slot is missing or its users' places were wiped."""
    users = decision.users or _recorded_users(decision, slot)
    columns = list(zip(*users, strict=True)) or [(), (), (), (), ()]
    pos_enu_m = np.array(columns[:2], dtype=np.float64).T.reshape(-1, 2)
    active = np.array(columns[4], dtype=np.bool_)
    if np.isnan(pos_enu_m[active]).any():
        raise RecheckError("where users were is not in the records any more (see docs/privacy.md)")
    return WorldState(
        slot=decision.slot,
        uav_pos_enu_m=np.array(decision.pos_enu_m, dtype=np.float64),
        uav_vel_enu_mps=np.array(decision.vel_enu_mps, dtype=np.float64),
        uav_energy_j=np.array(decision.energy_left_j, dtype=np.float64),
        uav_active=np.array(decision.active, dtype=np.bool_),
        user_pos_enu_m=pos_enu_m,
        user_data_mb=np.array(columns[2], dtype=np.float64),
        user_aoi_slots=np.array(columns[3], dtype=np.float64),
        user_active=active,
    )


def _recorded_users(
    decision: DecisionRecord, slot: SlotRecord | None
) -> tuple[tuple[float, float, float, float, bool], ...]:
    if slot is None:
        raise RecheckError(f"slot {decision.slot} is not in the records, and a decision was made at its start")
    return tuple((user.east_m, user.north_m, user.data_mb, user.aoi_slots, True) for user in slot.users)


def _differences(decision: DecisionRecord, now: JointAction) -> Iterator[Difference]:
    answers = zip(
        decision.heading_rad, decision.speed_mps, map(float, now.heading_rad), map(float, now.speed_mps), strict=True
    )
    for uav, (heading, speed, heading_now, speed_now) in enumerate(answers):
        if (heading, speed) != (heading_now, speed_now):
            yield Difference(decision.slot, uav, (heading, speed), (heading_now, speed_now))


def as_document(result: Recheck) -> Mapping[str, object]:
    """For ``--json``."""
    return {
        "decisions": result.decisions,
        "sessions": result.sessions,
        "slots": list(result.slots),
        "differences": [
            {"slot": one.slot, "uav": one.uav, "recorded": list(one.flown), "now": list(one.now)}
            for one in result.differences
        ],
    }
