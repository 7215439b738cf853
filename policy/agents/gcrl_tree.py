"""gcrl as printed: nine actions, Eq. 13-14 over predicted next states (``policy.search.paper_tree``)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from policy.agents.base import Decision
from policy.model.evaluator import Evaluator
from policy.model.states import StateBatch, Units
from policy.search.explain import shown
from policy.search.next_state import LearnedValue, next_state
from policy.search.paper_tree import Choice, Tree, TreeSettings, choose
from policy.world.actions import paper_actions
from policy.world.scenario import Scenario
from policy.world.state import JointAction

ALTERNATIVES = 3


class TreePilot:
    """One campaign's search. ``kind``: one of ``policy.search.next_state.NEXT_STATES``."""

    def __init__(
        self, scenario: Scenario, settings: TreeSettings, kind: str, evaluator: Evaluator, units: Units
    ) -> None:
        self._tree = Tree(
            scenario=scenario,
            actions=paper_actions(scenario.max_speed_mps),
            next_state=next_state(kind, scenario, evaluator, units),
            value=LearnedValue(scenario, evaluator, units),
            gamma=evaluator.spec.gamma,
            settings=settings,
        )

    def decide(self, now: StateBatch) -> Decision:
        """For a state (B = 1); the value told is minus the return expected, so that lower is better as everywhere."""
        choice = choose(self._tree, now)
        first, actions = choice.actions[0], self._tree.actions
        action = JointAction(actions.heading_rad[first], actions.speed_mps[first])
        return Decision(action, -float(choice.value[0]), self._explain(now, choice))

    def _explain(self, now: StateBatch, choice: Choice) -> Mapping[str, Any]:
        """As ``policy.search.explain``; the path is the slot's, an alternative the best joint action that differs."""
        return {
            "horizon_slots": self._tree.settings.depth,
            "value": -float(choice.value[0]),
            "predicted_gain": None,
            "uavs": [self._uav(now, choice, int(uav)) for uav in np.flatnonzero(now.uav_active[0])],
        }

    def _uav(self, now: StateBatch, choice: Choice, uav: int) -> dict[str, Any]:
        actions, scenario = self._tree.actions, self._tree.scenario
        first = int(choice.actions[0, uav])
        end_m = now.uav_pos_enu_m[0, uav] + actions.vel_enu_mps[first] * scenario.slot_s
        others: dict[int, float] = {}
        for joint, value in zip(choice.actions[1:], choice.value[1:], strict=True):
            if joint[uav] != first and joint[uav] not in others and len(others) < ALTERNATIVES:
                others[int(joint[uav])] = float(choice.value[0] - value)
        return {
            "uav": uav,
            **shown(float(actions.heading_rad[first]), float(actions.speed_mps[first])),
            "path_enu_m": [[round(float(end_m[0]), 1), round(float(end_m[1]), 1)]],
            "alternatives": [
                {
                    **shown(float(actions.heading_rad[other]), float(actions.speed_mps[other])),
                    "value": worse_by - float(choice.value[0]),
                    "worse_by": worse_by,
                }
                for other, worse_by in others.items()
            ],
        }
