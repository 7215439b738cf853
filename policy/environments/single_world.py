"""One campaign in flight on NumPy arrays, for environments that step one at a time."""

from dataclasses import asdict

import numpy as np
import numpy.typing as npt

from policy.environments.field import features
from policy.world.actions import paper_actions
from policy.world.airspace import legal_moves
from policy.world.arrays import BoolArray, FloatArray
from policy.world.metrics import campaign_metrics
from policy.world.reward import reward
from policy.world.scenario import Scenario
from policy.world.state import JointAction, initial_state
from policy.world.transition import Outcome, step


class SingleWorld:
    """``state`` is the world's, without batch."""

    def __init__(self, scenario: Scenario, places_enu_m: FloatArray) -> None:
        """``places_enu_m`` [T+1, M, 2]."""
        self.scenario = scenario
        self._places = places_enu_m
        self._actions = paper_actions(scenario.max_speed_mps)
        self.state = initial_state(scenario, places_enu_m[0])
        self._outcomes: list[Outcome] = []
        self._ages: list[FloatArray] = []
        self._data: list[FloatArray] = []

    @property
    def done(self) -> bool:
        """Whether all slots are flown."""
        return self.state.slot >= self.scenario.slots

    def observe(self) -> npt.NDArray[np.float32]:
        """[U, NUM_FEATURES]."""
        return np.asarray(features(self.scenario, self.state), dtype=np.float32)

    def legal(self) -> BoolArray:
        """Which of the nine actions stay inside and clear: bool [U, 9]; hovering where none does."""
        place, velocity = self.state.uav_pos_enu_m, self.state.uav_vel_enu_mps
        legal = np.asarray(
            legal_moves(place[:, None], velocity[:, None], self._actions.vel_enu_mps, self.scenario), dtype=np.bool_
        )
        legal[:, 0] |= ~legal.any(axis=1)
        return legal

    def step(self, actions: npt.ArrayLike) -> float:
        """Fly one slot, illegal actions as hovering: [U] -> reward of Eq. 8."""
        if self.done:
            raise RuntimeError("the campaign is over: reset() begins the next one")
        chosen = np.asarray(actions, dtype=np.int64)
        if chosen.shape != (self.scenario.num_uavs,) or chosen.min() < 0 or chosen.max() >= self._actions.size:
            raise ValueError(
                f"actions must be {self.scenario.num_uavs} numbers from 0 to {self._actions.size - 1}, not {actions!r}"
            )
        chosen = np.where(self.legal()[np.arange(chosen.size), chosen], chosen, 0)
        joint = JointAction(self._actions.heading_rad[chosen], self._actions.speed_mps[chosen])
        before = self.state
        self.state, outcome = step(self.scenario, before, joint, self._places[before.slot + 1])
        self._outcomes.append(outcome)
        self._ages.append(self.state.user_aoi_slots)
        self._data.append(self.state.user_data_mb)
        return float(reward(self.scenario, before, self.state, outcome))

    def metrics(self) -> dict[str, float]:
        """Eq. 5-7 over the slots flown."""
        spent_j = np.sum([outcome.energy_j for outcome in self._outcomes], axis=0)
        served = np.stack([outcome.served for outcome in self._outcomes])
        found = campaign_metrics(self.scenario, np.stack(self._ages), np.stack(self._data), served, spent_j)
        return {name: float(value) for name, value in asdict(found).items()}
