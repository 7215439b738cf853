"""Episodes to train on: fresh walkers each time, or the training part of a trace's users."""

from dataclasses import dataclass, replace

import numpy as np

from policy.evaluation.rollout import jittered
from policy.mission_file import Mission, MissionError, open_campaign
from policy.mobility.split import split_users
from policy.mobility.traces import TraceError, UserTraces
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario

SEEDS = 2**31 - 1


@dataclass(frozen=True)
class FreshWalkers:
    """Another crowd in every episode, of the mission's kind and size."""

    mission: Mission

    @property
    def description(self) -> str:
        """For the model card."""
        users = self.mission.users
        return f"{users.walkers} walkers of {users.preset or 'the default kind'}, drawn anew for each episode"

    def __call__(self, rng: np.random.Generator) -> tuple[Scenario, FloatArray]:
        """An episode: scenario and places [T+1, M, 2]."""
        users = replace(self.mission.users, seed=int(rng.integers(1, SEEDS)))
        scenario, traces = open_campaign(replace(self.mission, users=users))
        if traces is None:
            raise AssertionError("walkers are never live")
        return jittered(scenario, int(rng.integers(1, SEEDS))), traces.pos_enu_m


@dataclass(frozen=True)
class TrainingUsers:
    """The training users of a trace, from start points near the launch point."""

    scenario: Scenario
    traces: UserTraces

    @property
    def description(self) -> str:
        """For the model card."""
        return f"{self.traces.num_users} training users of {self.traces.source}: {', '.join(self.traces.user_ids)}"

    def __call__(self, rng: np.random.Generator) -> tuple[Scenario, FloatArray]:
        """An episode: scenario and places [T+1, M, 2]."""
        return jittered(self.scenario, int(rng.integers(1, SEEDS))), self.traces.pos_enu_m


Sampler = FreshWalkers | TrainingUsers


def episode_sampler(mission: Mission) -> tuple[Scenario, Sampler]:
    """The scenario to train for and the draw of episodes. Test users of a trace are never drawn.

    Raises MissionError where the mission has no users to train on.
    """
    scenario, traces = open_campaign(mission)
    if traces is None:
        raise MissionError(f'{mission.source.origin}: users with source = "live" cannot be trained on')
    if mission.users.kind == "walkers":
        return scenario, FreshWalkers(mission)
    sampler = _training_users(scenario, traces)
    return sampler.scenario, sampler


def _training_users(scenario: Scenario, traces: UserTraces) -> TrainingUsers:
    try:
        users = split_users(traces).train
    except TraceError as error:
        raise MissionError(str(error)) from error
    rates = dict(zip(traces.user_ids, scenario.collect_mbps, strict=True))
    collect_mbps = np.asarray([rates[user] for user in users.user_ids])
    return TrainingUsers(replace(scenario, collect_mbps=collect_mbps), users)
