"""One campaign flown in the world model by one agent, recorded slot by slot."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from policy.agents.base import Agent
from policy.world.airspace import hits_obstacle
from policy.world.arrays import BoolArray, FloatArray
from policy.world.geometry import pairwise_distance_m
from policy.world.metrics import Metrics, campaign_metrics
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState, initial_state
from policy.world.transition import Outcome, step

LAUNCH_JITTER_M = 50.0
"""Half width of the square around the launch point from which seeds above 0 start."""
JITTER_TRIES = 100


class Places(Protocol):
    """Users' places by sample; asked for sample t+1 only after slot t has been decided."""

    def positions(self, sample: int) -> FloatArray:
        """[M, 2] east, north metres."""


class SlotPhysics(Protocol):
    """What a slot does to UAVs, users, data and ages: the world's own transition, or a vehicle's dynamics."""

    def __call__(
        self, scenario: Scenario, state: WorldState, action: JointAction, next_user_pos_enu_m: FloatArray, /
    ) -> tuple[WorldState, Outcome]:
        """States without batch dimension; called slot after slot, ``state`` being the one answered last."""


@dataclass
class CampaignRecord:
    """What happened: index t of the first axis is the state after t slots (0: the start)."""

    scenario: Scenario
    states: list[WorldState]
    heading_rad: list[FloatArray] = field(default_factory=list)  # T of [U]
    speed_mps: list[FloatArray] = field(default_factory=list)  # T of [U]
    outcomes: list[Outcome] = field(default_factory=list)  # T
    decision_ms: list[float] = field(default_factory=list)  # T

    @property
    def aoi_slots(self) -> FloatArray:
        """[T, M] after each slot."""
        return np.stack([state.user_aoi_slots for state in self.states[1:]])

    @property
    def served(self) -> BoolArray:
        """[T, M]."""
        return np.stack([outcome.served for outcome in self.outcomes])

    @property
    def energy_used_j(self) -> FloatArray:
        """[U] over the campaign."""
        return np.asarray(np.sum([outcome.energy_j for outcome in self.outcomes], axis=0), dtype=np.float64)

    @property
    def metrics(self) -> Metrics:
        """Eq. 5-7 over the slots flown so far."""
        data_mb = np.stack([state.user_data_mb for state in self.states[1:]])
        return campaign_metrics(self.scenario, self.aoi_slots, data_mb, self.served, self.energy_used_j)

    @property
    def violations(self) -> dict[str, int]:
        """UAV-slots in which a rule was broken; own UAVs are apart by altitude layers unless those are off."""
        return {
            "geofence": sum(int(np.sum(outcome.left_area)) for outcome in self.outcomes),
            "separation": sum(_too_close(self.scenario, state) for state in self.states[1:]),
            "obstacle": sum(int(np.sum(outcome.hit_obstacle)) for outcome in self.outcomes),
            "battery": sum(int(np.sum(outcome.ran_empty)) for outcome in self.outcomes),
        }


def fly(
    scenario: Scenario,
    places: Places,
    agent: Agent,
    seed: int = 0,
    *,
    on_slot: Callable[[], None] | None = None,
    physics: SlotPhysics = step,
) -> CampaignRecord:
    """Fly all slots of ``scenario`` with ``agent``; the agent sees users up to the present sample only."""
    agent.reset(scenario, seed)
    state = initial_state(scenario, places.positions(0))
    record = CampaignRecord(scenario, [state])
    for slot in range(scenario.slots):
        begun_s = time.perf_counter()
        action = agent.decide(state).action
        record.decision_ms.append(1e3 * (time.perf_counter() - begun_s))
        state, outcome = physics(scenario, state, action, places.positions(slot + 1))
        record.states.append(state)
        record.outcomes.append(outcome)
        record.heading_rad.append(np.asarray(action.heading_rad, dtype=np.float64))
        record.speed_mps.append(np.asarray(action.speed_mps, dtype=np.float64))
        if on_slot is not None:
            on_slot()
    return record


def jittered(scenario: Scenario, seed: int) -> Scenario:
    """The campaign for one seed: 0 starts at the launch point, others within 50 m of it where a UAV may be."""
    if seed == 0:
        return scenario
    rng = np.random.default_rng(seed)
    for _ in range(JITTER_TRIES):
        offset_m = rng.uniform(-LAUNCH_JITTER_M, LAUNCH_JITTER_M, size=(1, 2))
        moved = np.clip(scenario.launch_enu_m + offset_m, 0.0, np.asarray(scenario.area.size_m))
        if not np.any(hits_obstacle(moved, scenario, scenario.obstacle_margin_m)):
            return replace(scenario, launch_enu_m=moved)
    return scenario  # hemmed in by obstacles: the launch point itself is known to be clear


def _too_close(scenario: Scenario, state: WorldState, minimum_m: float = 5.0) -> int:
    if scenario.layer_m >= minimum_m:
        return 0
    distance_m = pairwise_distance_m(state.uav_pos_enu_m, state.uav_pos_enu_m)
    return int(np.sum(np.triu(distance_m < minimum_m, k=1)))
