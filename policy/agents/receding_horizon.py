"""Plans H slots ahead as if users stayed where they are, flies the first, keeps the rest (no learning)."""

from dataclasses import replace

import numpy as np

from policy.agents.base import Decision, Explanation
from policy.search.explain import explain
from policy.search.moves import Moves, make_moves
from policy.search.plan import Kept, Plan
from policy.search.planner import make_plan
from policy.search.problem import make_problem
from policy.search.settings import SearchSettings, settings_for
from policy.world.scenario import Scenario
from policy.world.state import WorldState, initial_state


class RecedingHorizonAgent:
    """The plain planner: beam search, one UAV at a time, from the plan kept from the slot before."""

    name = "receding-horizon"

    def __init__(self, settings: SearchSettings | None = None) -> None:
        """``settings``: None takes the moves that suit the vehicle's acceleration limit."""
        self._given = settings
        self._scenario: Scenario | None = None
        self._settings: SearchSettings
        self._moves: Moves
        self._plan: Plan | None = None

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Tabulate the moves, and compile the search now rather than in the first slot."""
        self._scenario, self._plan = scenario, None
        self._settings = self._given or settings_for(scenario)
        self._moves = make_moves(scenario, self._settings)
        state = initial_state(scenario, np.zeros((scenario.num_users, 2)))
        for slot in range(2):  # the second one starts from a kept plan
            self.decide(replace(state, slot=slot))
        self._plan = None

    def decide(self, state: WorldState) -> Decision:
        """Plan from ``state`` and fly the plan's first slot."""
        if self._scenario is None:
            raise RuntimeError("decide() before reset(): the agent does not know its campaign")
        problem = make_problem(self._scenario, self._moves, state, self._settings)
        plan = make_plan(problem, self._kept(state.slot))
        self._plan = plan
        return Decision(plan.first_action, plan.value, Explanation(lambda: explain(problem, plan)))

    def _kept(self, slot: int) -> Kept | None:
        if self._plan is None or not 0 < slot - self._plan.slot < self._plan.actions.shape[1]:
            return None
        return self._plan.shifted(slot - self._plan.slot)
