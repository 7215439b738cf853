"""A plan in words that an operator's page can show: JSON-able, plain numbers."""

import math
from collections.abc import Mapping
from typing import Any

from policy.search.alternatives import Alternative
from policy.search.plan import Plan
from policy.search.problem import Problem
from policy.world.actions import ActionSet


def explain(problem: Problem, plan: Plan) -> Mapping[str, Any]:
    """Why this move: the price of the plan, what it gains on the one kept, each UAV's path and its alternatives.

    Prices are slots of mean AoI summed over the horizon and what comes after (lower is better).
    """
    return {
        "horizon_slots": problem.horizon_slots,
        "value": plan.value,
        "predicted_gain": None if plan.kept_value is None else plan.kept_value - plan.value,
        "uavs": [_uav(problem, plan, int(uav)) for uav in problem.planned],
    }


def _uav(problem: Problem, plan: Plan, uav: int) -> dict[str, Any]:
    actions, flown = problem.moves.actions, plan.first_action
    return {
        "uav": uav,
        **shown(float(flown.heading_rad[uav]), float(flown.speed_mps[uav])),
        "path_enu_m": [[round(float(east), 1), round(float(north), 1)] for east, north in plan.path_enu_m[uav]],
        "alternatives": [_alternative(actions, other, plan.value) for other in plan.alternatives[uav]],
    }


def _alternative(actions: ActionSet, other: Alternative, best: float) -> dict[str, float]:
    return {**_move(actions, other.action), "value": other.value, "worse_by": other.value - best}


def _move(actions: ActionSet, action: int) -> dict[str, float]:
    return shown(float(actions.heading_rad[action]), float(actions.speed_mps[action]))


def shown(heading_rad: float, speed_mps: float) -> dict[str, float]:
    """A command in the units that people read."""
    return {"heading_deg": round(math.degrees(heading_rad), 3), "speed_mps": speed_mps}
