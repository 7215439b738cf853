"""Random: every UAV takes one of the paper's nine actions, each as likely as the others (Section VII-F)."""

import numpy as np

from policy.agents.base import Decision
from policy.world.actions import ActionSet, paper_actions
from policy.world.airspace import legal_moves
from policy.world.arrays import BoolArray
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState


class UniformAgent:
    """The floor that every method has to clear."""

    name = "random"

    def __init__(self, *, keep_inside: bool = True) -> None:
        """``keep_inside``: choose among the legal moves only; False is the paper's, which may leave the map."""
        self._keep_inside = keep_inside
        self._scenario: Scenario
        self._actions: ActionSet
        self._rng = np.random.default_rng(0)

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Begin a campaign with a generator of its own."""
        self._scenario, self._actions = scenario, paper_actions(scenario.max_speed_mps)
        self._rng = np.random.default_rng(seed)

    def decide(self, state: WorldState) -> Decision:
        """One draw for each UAV."""
        choices = np.array([self._draw(row) for row in self._choosable(state)])
        joint = JointAction(self._actions.heading_rad[choices], self._actions.speed_mps[choices])
        return Decision(joint, explanation={"drawn_from": self._actions.size})

    def _choosable(self, state: WorldState) -> BoolArray:
        """[U, 9], of the whole fleet at once: one by one a hundred UAVs hold the interpreter six times as long."""
        if not self._keep_inside:
            return np.ones((state.uav_pos_enu_m.shape[0], self._actions.size), dtype=np.bool_)
        place, velocity = state.uav_pos_enu_m[:, None], state.uav_vel_enu_mps[:, None]
        return np.asarray(legal_moves(place, velocity, self._actions.vel_enu_mps, self._scenario))

    def _draw(self, choosable: BoolArray) -> int:
        legal = np.flatnonzero(choosable)
        return int(self._rng.choice(legal)) if legal.size else 0  # hovering is the safest where nothing is legal
