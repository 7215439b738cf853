"""Fig. 2, measured: how much each UAV attends to each user (Eq. 11d) in the middle of a campaign flown from seed 0."""

import hashlib
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np

from policy.evaluation.rollout import fly, jittered
from policy.evaluation.tables.campuses import Campus, canonical
from policy.evaluation.tables.cells import PATH_DECIMALS
from policy.evaluation.tables.grid import BASE_MCL_DB, BASE_UAVS
from policy.evaluation.tables.methods import Method
from policy.evaluation.tables.sources import code_version
from policy.mobility.feed import TraceFeed
from policy.mobility.traces import UserTraces
from policy.model.checkpoint import load_evaluator
from policy.model.history import StepHistory
from policy.model.states import STEPS, Units, stack_states
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario
from policy.world.state import WorldState

LAYOUT = 1
"""Of the file; files of another are made again."""
WEIGHT_DECIMALS = 5


@dataclass(frozen=True)
class RelationsTask:
    """One slot of one campus."""

    key: str
    campus: str
    method: Method  # ``gcrl`` with its network
    scenario: Scenario
    traces: UserTraces
    slot: int  # before this one is flown


def make_relations(campus: Campus, method: Method) -> RelationsTask:
    """The middle of the campaign: slot 60 of 120."""
    scenario, traces = campus.opened(BASE_UAVS, BASE_MCL_DB)
    slot = scenario.slots // 2
    inputs = {
        "relations": [LAYOUT, campus.digest(BASE_UAVS, BASE_MCL_DB)],
        **method.document(),
        "slots": scenario.slots,
        "slot": slot,
        "code": code_version(method.policy),
    }
    key = "relations-" + hashlib.sha256(canonical(inputs).encode()).hexdigest()[:22]
    return RelationsTask(key, campus.name, method, scenario, traces, slot)


def weigh_relations(task: RelationsTask) -> dict[str, Any]:
    """What the file holds: places in metres, users' AoI, and the weights [U][M]."""
    places = TraceFeed(task.traces).as_places()
    record = fly(jittered(task.scenario, 0), places, task.method.choice().build(), 0)
    state = record.states[task.slot]
    return {
        "key": task.key,
        "campus": task.campus,
        "network": task.method.network,
        "slot": task.slot,
        "uav_pos_m": np.round(state.uav_pos_enu_m, PATH_DECIMALS).tolist(),
        "user_pos_m": np.round(state.user_pos_enu_m, PATH_DECIMALS).tolist(),
        "user_aoi_slots": np.round(state.user_aoi_slots, PATH_DECIMALS).tolist(),
        "weights": np.round(relations(task, record.states), WEIGHT_DECIMALS).tolist(),
        "code": code_version(task.method.policy),
        "finished_utc": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def relations(task: RelationsTask, states: list[WorldState]) -> FloatArray:
    """Weights [U, M] of the task's network in its slot; what a UAV gives to UAVs is the rest to one."""
    history = StepHistory(STEPS)
    for state in states[: task.slot + 1]:
        history.see(state)
    now = stack_states([states[task.slot]], history.steps_m[None])
    evaluator = load_evaluator(task.method.checkpoint)
    return np.asarray(evaluator.relations(now, Units.of(task.scenario))[0])
