"""Lines 3 to 11 of Algorithm 1: fly one campaign, now and then at random, and keep what the network needs."""

from dataclasses import replace

import numpy as np

from policy.agents.base import Agent, Decision
from policy.evaluation.rollout import CampaignRecord, SlotPhysics, fly
from policy.model.features import action_features, make_features
from policy.model.states import Units, last_steps_m, stack_states
from policy.training.replay import Episode
from policy.world.actions import paper_actions
from policy.world.airspace import legal_moves
from policy.world.arrays import FloatArray
from policy.world.frames import velocity_enu_mps
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState
from policy.world.transition import step


class ArrayPlaces:
    """Users' places [T+1, M, 2] as a rollout asks for them."""

    def __init__(self, pos_enu_m: FloatArray) -> None:
        self._pos_enu_m = pos_enu_m

    def positions(self, sample: int) -> FloatArray:
        """[M, 2] at ``sample``."""
        return np.asarray(self._pos_enu_m[sample])


class Exploring:
    """An agent that in a share of slots flies every UAV by a random legal action of the paper's nine."""

    def __init__(self, agent: Agent, share: float, rng: np.random.Generator) -> None:
        self.name = agent.name
        self._agent = agent
        self._share = share
        self._rng = rng
        self._scenario: Scenario | None = None

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Begin a campaign."""
        self._scenario = scenario
        self._agent.reset(scenario, seed)

    def decide(self, state: WorldState) -> Decision:
        """The agent's decision, or a random one; the agent is asked all the same, it may keep a plan."""
        assert self._scenario is not None, "reset comes first"
        decision = self._agent.decide(state)
        if self._rng.random() >= self._share:
            return decision
        return replace(decision, action=random_action(self._scenario, state, self._rng))


def random_action(scenario: Scenario, state: WorldState, rng: np.random.Generator) -> JointAction:
    """Each UAV by itself: one of the nine actions that is legal, or braking where none is."""
    actions = paper_actions(scenario.max_speed_mps)
    legal = legal_moves(
        state.uav_pos_enu_m[:, None, :], state.uav_vel_enu_mps[:, None, :], actions.vel_enu_mps[None], scenario
    )
    chosen = [int(rng.choice(np.flatnonzero(row))) if row.any() else 0 for row in legal]
    return JointAction(heading_rad=actions.heading_rad[chosen], speed_mps=actions.speed_mps[chosen])


def fly_episode(
    scenario: Scenario,
    pos_enu_m: FloatArray,
    agent: Agent,
    share: float,
    rng: np.random.Generator,
    physics: SlotPhysics = step,
) -> tuple[Episode, float]:
    """One campaign with users at ``pos_enu_m`` [T+1, M, 2]; also its episodic AoI (Eq. 7)."""
    pilot, seed = Exploring(agent, share, rng), int(rng.integers(2**31))
    record = fly(scenario, ArrayPlaces(pos_enu_m), pilot, seed, physics=physics)
    return make_episode(record), record.metrics.episodic_aoi


def make_episode(record: CampaignRecord) -> Episode:
    """What the network sees of a campaign flown."""
    units = Units.of(record.scenario)
    place_m = np.stack([state.user_pos_enu_m for state in record.states])
    states = stack_states(record.states, last_steps_m(place_m))
    features = make_features(states, units)
    command_mps = velocity_enu_mps(np.stack(record.heading_rad), np.stack(record.speed_mps))
    way = np.diff(states.uav_pos_enu_m, axis=0) / units.reach_m
    spent = -np.diff(states.uav_energy_j, axis=0) / units.battery_j
    return Episode(
        uav=features.uav,
        user=features.user,
        uav_mask=features.uav_mask,
        user_mask=features.user_mask,
        aoi_slots=states.user_aoi_slots.astype(np.float32),
        action=action_features(command_mps, units),
        uav_next=np.concatenate((way, spent[..., None]), axis=-1).astype(np.float32),
    )
