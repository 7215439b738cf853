"""One cell of the grid: a campaign flown once. Its key is the digest of all that decides the outcome."""

import hashlib
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np

from policy.evaluation.results import METRIC_NAMES
from policy.evaluation.rollout import CampaignRecord, fly, jittered
from policy.evaluation.tables.campuses import Campus, canonical
from policy.evaluation.tables.methods import Method
from policy.evaluation.tables.sources import code_version
from policy.mobility.feed import TraceFeed
from policy.mobility.traces import UserTraces
from policy.world.scenario import Scenario

PATH_DECIMALS = 1
"""Kept paths are for drawing: decimetres are enough."""


@dataclass(frozen=True)
class Point:
    """What is averaged over seeds: one method on one campus with one fleet and one radio."""

    campus: str
    method: Method
    uavs: int
    mcl_db: float


@dataclass(frozen=True)
class Task:
    """A cell with all that a worker needs to fly it: no files but the checkpoint's."""

    key: str
    point: Point
    seed: int
    scenario: Scenario
    traces: UserTraces

    @property
    def method(self) -> Method:
        """What flies: the training of this seed where there are several."""
        return self.point.method.for_seed(self.seed)


def make_task(campus: Campus, point: Point, seed: int) -> Task:
    """The cell's task. Raises MissionError where the campaign cannot be flown so."""
    scenario, traces = campus.opened(point.uavs, point.mcl_db)
    return Task(cell_key(campus, point, seed), point, seed, scenario, traces)


def cell_key(campus: Campus, point: Point, seed: int) -> str:
    """Hexadecimal digest of the cell's inputs."""
    inputs = {
        "campus": campus.digest(point.uavs, point.mcl_db),
        "uavs": point.uavs,
        "mcl_db": point.mcl_db,
        "slots": campus.slots,
        "seed": seed,
        **point.method.for_seed(seed).document(),
        "code": code_version(point.method.policy),
    }
    return hashlib.sha256(canonical(inputs).encode()).hexdigest()[:32]


def fly_task(task: Task) -> dict[str, Any]:
    """Fly the cell: what its file holds. The same campaign as ``evaluate`` flies for this seed."""
    begun = datetime.now(UTC)
    agent = task.method.choice().build()
    places = TraceFeed(task.traces).as_places()
    record = fly(jittered(task.scenario, task.seed), places, agent, task.seed)
    seconds = (datetime.now(UTC) - begun).total_seconds()
    return {**_inputs(task), **_outcome(record), **_kept_paths(task, record), "wall_s": round(seconds, 3)}


def _inputs(task: Task) -> dict[str, Any]:
    return {
        "key": task.key,
        "campus": task.point.campus,
        **task.method.document(),
        "uavs": task.point.uavs,
        "mcl_db": task.point.mcl_db,
        "slots": task.scenario.slots,
        "seed": task.seed,
        "code": code_version(task.method.policy),
        "finished_utc": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _outcome(record: CampaignRecord) -> dict[str, Any]:
    metrics = record.metrics
    p50, p99 = np.percentile(record.decision_ms, (50.0, 99.0))
    return {
        "metrics": {name: float(getattr(metrics, name)) for name in METRIC_NAMES},
        "decision_ms": {"p50": float(p50), "p99": float(p99)},  # beside other work: Table II is measured apart
        "violations": record.violations,
    }


def _kept_paths(task: Task, record: CampaignRecord) -> dict[str, Any]:
    """UAVs' places [T+1][U][2] of the flight from the launch point itself, to be drawn as in Fig. 3."""
    if task.seed != 0:
        return {}
    places = np.stack([state.uav_pos_enu_m for state in record.states])
    return {"uav_paths_m": np.round(places, PATH_DECIMALS).tolist()}
