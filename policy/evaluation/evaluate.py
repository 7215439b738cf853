"""Scores a policy on a mission in the world model: one campaign a seed."""

from collections.abc import Callable
from dataclasses import dataclass

from policy.agents.registry import PolicyChoice
from policy.evaluation.results import CampaignResult, summed
from policy.evaluation.rollout import CampaignRecord, fly, jittered
from policy.mission_file import Mission, MissionError, open_campaign
from policy.mobility.feed import TraceFeed


@dataclass(frozen=True)
class Evaluation:
    """The score, and how it came about: one record a seed."""

    result: CampaignResult
    records: tuple[CampaignRecord, ...]
    user_ids: tuple[str, ...]


def policy_of(mission: Mission, name: str | None = None, checkpoint: str | None = None) -> PolicyChoice:
    """What was asked for; the mission's own checkpoint goes with the mission's own policy only."""
    if name is None or name == mission.policy:
        return PolicyChoice(mission.policy, checkpoint or mission.checkpoint)
    return PolicyChoice(name, checkpoint)


def evaluate(
    mission: Mission,
    policy: PolicyChoice,
    *,
    seeds: int = 1,
    on_slot: Callable[[], None] | None = None,
) -> Evaluation:
    """Fly seeds 0..K-1; seed 0 from the launch point itself, the others from within 50 m of it.

    Raises MissionError (users), UnknownPolicyError (policy) or the method's own CheckpointError.
    """
    scenario, traces = open_campaign(mission)
    if traces is None:
        raise MissionError(f'{mission.source.origin}: users with source = "live" cannot be evaluated; fly the mission')
    agent = policy.build()
    records = tuple(
        fly(jittered(scenario, seed), TraceFeed(traces).as_places(), agent, seed, on_slot=on_slot)
        for seed in range(seeds)
    )
    result = CampaignResult(
        mission=mission.name,
        policy=policy.name,
        uavs=scenario.num_uavs,
        mcl_db=scenario.radio.mcl_db,
        slots=scenario.slots,
        metrics=tuple(record.metrics for record in records),
        decision_ms=tuple(ms for record in records for ms in record.decision_ms),
        violations=summed([record.violations for record in records]),
    )
    return Evaluation(result, records, traces.user_ids)
