"""GCRL-min(AoI): look-ahead over predicted users (Eq. 13-14) that ends in a learned value, related by an RGCN.

UAV motion, energy and AoI are known exactly, so the search uses the world's own; what is learned is what is not
known: where users go (f_2 of Eq. 12) and what a state is worth beyond the horizon (f^val). The network runs on
onnxruntime; torch is not imported. Differences from the paper, and what each is worth: ``docs/gcrl.md``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from policy.agents.base import Decision, Explanation
from policy.agents.gcrl_tree import TreePilot
from policy.model.checkpoint import load_evaluator
from policy.model.evaluator import Evaluator
from policy.model.forecast_features import HISTORY_SLOTS
from policy.model.history import StepHistory
from policy.model.states import STEPS, StateBatch, Units, push_step, stack_states
from policy.search.explain import explain
from policy.search.moves import Moves, make_moves
from policy.search.paper_tree import TreeSettings
from policy.search.plan import Kept, Plan
from policy.search.planner import make_plan
from policy.search.problem import make_problem
from policy.search.settings import SearchSettings, settings_for
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario
from policy.world.state import WorldState, initial_state

BLUR_GROWTH = 0.5
"""A slot, of the first slot's blur."""
MOST_BLUR = 0.9
"""Of the serving radius: beyond it nobody could be served for sure."""
EXPLAINED_USERS = 5
"""Users shown for each UAV, those that it attends to most."""


@dataclass(frozen=True)
class GcrlSettings:
    """What is searched and which learned parts are asked."""

    search: SearchSettings | None = None  # None: those that suit the campaign, as receding-horizon flies
    use_value: bool = False  # at the leaves; else the closed form "AoI x slots to reach", which measures no worse
    use_prediction: bool = True  # of users; else they stay (ablation "w/o pred")
    use_forecast: bool = True  # places and doubt as forecast for every slot of the horizon; else by f_2 and a rule:
    predicted_slots: int = 3  # asked of the network one after the other; then users are taken to stay
    blur_share: float = 0.5  # of a user's mean way a slot: how far off the first prediction may be; 0: certain
    tree: TreeSettings | None = None  # the paper's own search instead of the beam; the rest then does not matter ...
    next_state: str = "exact"  # ... but this: ``policy.search.next_state.NEXT_STATES``, asked by the tree

    @classmethod
    def paper(cls, depth: int = 3, next_state: str = "learned") -> "GcrlSettings":
        """The paper's experiments: nine actions, N = 3, learned next states and value, Eq. 12-14 (Section VII-C)."""
        return cls(use_value=True, use_forecast=False, tree=TreeSettings(depth), next_state=next_state)

    @classmethod
    def for_warmup(cls, horizon_slots: int, beam: int) -> "GcrlSettings":
        """The plain planner, narrow, since training needs many decisions rather than the best."""
        search = SearchSettings(horizon_slots=horizon_slots, beam=beam, rounds=1, rebuilds=0)
        return cls(search=search, use_prediction=False)

    def without_network(self) -> "GcrlSettings":
        """The plain planner that this one grows from."""
        return replace(self, use_value=False, use_prediction=False)


class GcrlAgent:
    """The default policy. One instance flies one campaign at a time and keeps its plan from slot to slot."""

    name = "gcrl"

    def __init__(self, settings: GcrlSettings | None = None, evaluator: Evaluator | None = None) -> None:
        """``evaluator``: None loads the shipped checkpoint."""
        self._settings = settings or GcrlSettings()
        self._evaluator: Evaluator = evaluator or load_evaluator()
        self._scenario: Scenario | None = None
        self._units: Units
        self._search: SearchSettings
        self._moves: Moves
        self._plan: Plan | None = None
        self._pilot: TreePilot | None = None
        self._history = StepHistory(HISTORY_SLOTS)

    @classmethod
    def load(cls, checkpoint: Path | str | None = None, settings: GcrlSettings | None = None) -> "GcrlAgent":
        """With a trained folder or file; CheckpointError if it cannot be used. None: the shipped default."""
        return cls(settings, load_evaluator(checkpoint))

    def reset(self, scenario: Scenario, seed: int) -> None:
        """Tabulate the moves, and compile the search now rather than in the first slot."""
        self._scenario, self._units = scenario, Units.of(scenario)
        tree = self._settings.tree
        if tree is not None:
            kind = self._settings.next_state
            self._pilot = TreePilot(scenario, tree, kind, self._evaluator, self._units)
        self._search = self._settings.search or settings_for(scenario)
        self._moves = make_moves(scenario, self._search)
        self._forget()
        state = initial_state(scenario, np.zeros((scenario.num_users, 2)))
        for slot in range(2):  # the second one starts from a kept plan
            self.decide(replace(state, slot=slot))
        self._forget()

    def decide(self, state: WorldState) -> Decision:
        """Predict, search, fly the plan's first slot; see :meth:`_explain` for what is told beside it."""
        if self._scenario is None:
            raise RuntimeError("decide() before reset(): the agent does not know its campaign")
        self._history.see(state)
        steps_m = self._history.steps_m[None, :, :STEPS]
        if self._pilot is not None:
            now = stack_states([state], steps_m)
            decision = self._pilot.decide(now)
            told = Explanation(
                lambda: {
                    **decision.explanation,
                    **self._explain(now, self._evaluator.predict_users(now, self._units)),
                }
            )
            return replace(decision, explanation=told)
        predicted_m, blur_m = self._users_ahead(state, steps_m)
        problem = make_problem(self._scenario, self._moves, state, self._search, predicted_m, blur_m)
        leaf = _LeafValue(self._evaluator, self._units) if self._settings.use_value else None
        plan = make_plan(problem, self._kept(state.slot), leaf)
        self._plan = plan
        told = Explanation(
            lambda: {**explain(problem, plan), **self._explain(stack_states([state], steps_m), predicted_m)}
        )
        return Decision(plan.first_action, plan.value, told)

    def _users_ahead(self, state: WorldState, steps_m: FloatArray) -> tuple[FloatArray | None, FloatArray | None]:
        """Users' places [H, M, 2] and how far off they may be [H, M]; None: they stay, for certain.

        ``steps_m`` [1, M, K, 2]: of the last slots, where the forecast is not asked.
        """
        settings = self._settings
        if not settings.use_prediction:
            return None, None
        if not settings.use_forecast:
            return self._predict(stack_states([state], steps_m)), self._blur_m()
        ahead = self._evaluator.forecast_users(state, self._history, self._units).up_to(self._search.horizon_slots)
        return ahead.pos_enu_m, np.minimum(ahead.blur_m, MOST_BLUR * self._units.serving_radius_m)

    def _predict(self, now: StateBatch) -> FloatArray:
        """Users' places at the ends of the next slots [H, M, 2]: Eq. 12 applied to its own answers, then they stay."""
        horizon = self._search.horizon_slots
        places: list[FloatArray] = []
        state = now
        for _ in range(min(self._settings.predicted_slots, horizon)):
            next_m = self._evaluator.predict_users(state, self._units)
            step_m = np.where(state.user_active[..., None], next_m - state.user_pos_enu_m, 0.0)
            steps_m = push_step(state.user_steps_m, step_m)
            state = replace(state, user_pos_enu_m=state.user_pos_enu_m + step_m, user_steps_m=steps_m)
            places.append(state.user_pos_enu_m[0])
        places += [state.user_pos_enu_m[0]] * (horizon - len(places))
        return np.stack(places)

    def _blur_m(self) -> FloatArray:
        """How far off predictions may be [H, M]: nothing for who stands, more and more for who moves."""
        way_m = np.mean(np.linalg.norm(self._history.steps_m[:, :STEPS], axis=-1), axis=1)
        growth = 1.0 + BLUR_GROWTH * np.arange(self._search.horizon_slots)[:, None]
        blur_m = self._settings.blur_share * way_m * growth
        return np.asarray(np.minimum(blur_m, MOST_BLUR * self._units.serving_radius_m))

    def _kept(self, slot: int) -> Kept | None:
        if self._plan is None or not 0 < slot - self._plan.slot < self._plan.actions.shape[1]:
            return None
        return self._plan.shifted(slot - self._plan.slot)

    def _forget(self) -> None:
        self._plan = None
        self._history.forget()

    def _explain(self, now: StateBatch, predicted_m: FloatArray | None) -> Mapping[str, Any]:
        """Relation weights of Eq. 11d (UAV to user, the greatest few) and users' predicted next places."""
        weights = self._evaluator.relations(now, self._units)[0]
        order = np.argsort(-weights, axis=1, kind="stable")[:, :EXPLAINED_USERS]
        told = predicted_m[0] if predicted_m is not None else now.user_pos_enu_m[0]
        return {
            "relations": [
                [{"user": int(user), "weight": round(float(row[user]), 4)} for user in users]
                for row, users in zip(weights, order, strict=True)
            ],
            "predicted_user_enu_m": [[round(float(e), 1), round(float(n), 1)] for e, n in told],
        }


class _LeafValue:
    """The learned price of what follows the horizon, as the search asks for it."""

    def __init__(self, evaluator: Evaluator, units: Units) -> None:
        self._evaluator, self._units = evaluator, units

    def __call__(self, states: WorldState) -> FloatArray:
        """States [B] at the end of the horizon -> discounted sum of mean AoI after them [B]."""
        steps_m = np.zeros(
            (*states.user_aoi_slots.shape, STEPS, 2)
        )  # beyond the predicted slots users are taken to stay
        batch = StateBatch(
            uav_pos_enu_m=states.uav_pos_enu_m,
            uav_vel_enu_mps=states.uav_vel_enu_mps,
            uav_energy_j=states.uav_energy_j,
            uav_active=states.uav_active,
            user_pos_enu_m=states.user_pos_enu_m,
            user_steps_m=steps_m,
            user_data_mb=states.user_data_mb,
            user_aoi_slots=states.user_aoi_slots,
            user_active=states.user_active,
        )
        return -self._evaluator.value(batch, self._units)
