"""The plain planner as an agent: no future read, no rule broken, and the reference figures held on real traces."""

import csv
import json
import math
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from policy.agents.receding_horizon import RecedingHorizonAgent
from policy.agents.uniform import UniformAgent
from policy.evaluation.rollout import fly, jittered
from policy.search.settings import SearchSettings, settings_for
from policy.world.scenario import Area, Scenario
from policy.world.state import initial_state

QUICK = SearchSettings(horizon_slots=8, beam=12, rebuilds=1)
AREAS_M = {"purdue_59": (1667.0, 1222.0), "ncsu_33": (3255.49, 2718.39), "kaist_92": (2100.21, 2174.93)}


class Track:
    """Users' places [T + 1, M, 2]."""

    def __init__(self, pos_m: np.ndarray) -> None:
        self.pos_m = pos_m

    def positions(self, sample: int) -> np.ndarray:
        return self.pos_m[sample]


def walk(seed: int, slots: int = 20, num_users: int = 12) -> Track:
    rng = np.random.default_rng(seed)
    steps = rng.normal(0.0, 15.0, (slots + 1, num_users, 2))
    return Track(np.clip(rng.uniform(0.0, 1200.0, (num_users, 2)) + np.cumsum(steps, axis=0), 0.0, 1200.0))


def scenario(size_m: tuple[float, float], num_users: int, accel: float = math.inf, slots: int = 120) -> Scenario:
    launch = np.tile([[0.5 * size_m[0], 0.5 * size_m[1]]], (2, 1))
    return Scenario(Area((40.0, -86.0), size_m), launch, np.full(num_users, 0.02), slots, max_accel_mps2=accel)


def test_it_reads_no_later_place_than_the_present() -> None:
    place, track = scenario((1200.0, 1200.0), 12, slots=20), walk(1)
    scrambled = Track(np.concatenate((track.pos_m[:11], walk(2).pos_m[11:])))
    first, second = (fly(place, t, RecedingHorizonAgent(QUICK)) for t in (track, scrambled))
    assert np.array_equal(first.heading_rad[:11], second.heading_rad[:11])
    assert np.array_equal(first.speed_mps[:11], second.speed_mps[:11])


@pytest.mark.parametrize("accel", [math.inf, 4.5, 2.5])
def test_it_breaks_no_rule_and_beats_chance(accel: float) -> None:
    place, track = scenario((1200.0, 1200.0), 12, accel, slots=20), walk(3)
    planned, random = fly(place, track, RecedingHorizonAgent(QUICK)), fly(place, track, UniformAgent())
    assert not any(planned.violations.values())
    assert planned.metrics.episodic_aoi < random.metrics.episodic_aoi


def test_it_says_why_in_json() -> None:
    place, track = scenario((1200.0, 1200.0), 12, slots=20), walk(4)
    agent = RecedingHorizonAgent(QUICK)
    agent.reset(place, 0)
    state = initial_state(place, track.positions(0))
    agent.decide(state)
    decision = agent.decide(replace(state, slot=1))
    told = json.loads(json.dumps(dict(decision.explanation)))
    assert told["predicted_gain"] >= -1e-6
    assert len(told["uavs"]) == 2
    assert len(told["uavs"][0]["path_enu_m"]) == QUICK.horizon_slots
    assert all(other["worse_by"] >= -1e-3 for uav in told["uavs"] for other in uav["alternatives"])


def test_it_must_know_its_campaign_first() -> None:
    place = scenario((1200.0, 1200.0), 12)
    with pytest.raises(RuntimeError, match="reset"):
        RecedingHorizonAgent().decide(initial_state(place, np.zeros((12, 2))))


def read_trace(name: str) -> Track:
    folder = Path(os.environ.get("UCS_DATA_DIR", "../shared/data/mobility"))
    if not (folder / f"{name}.csv").exists():
        pytest.skip("real traces are not here: set UCS_DATA_DIR")
    with (folder / f"{name}.csv").open() as file:
        rows = [
            (int(r["id"]), int(r["timestamp"]), float(r["x_distance"]), float(r["y_distance"]))
            for r in csv.DictReader(file)
        ]
    table = np.array(sorted(rows))
    return Track(table[:, 2:].reshape(-1, 121, 2).swapaxes(0, 1))


@pytest.mark.traces
@pytest.mark.parametrize(
    ("name", "accel", "most"),
    [  # the reference figures of docs/planner.md with room for the noise of one start and for the fast settings
        ("purdue_59", math.inf, 2.63 + 0.2),
        ("ncsu_33", math.inf, 6.46 + 0.5),
        ("kaist_92", math.inf, 2.20 + 0.15),
        ("purdue_59", 4.5, 3.03 + 0.2),
    ],
)
def test_it_holds_the_reference_on_real_traces(name: str, accel: float, most: float) -> None:
    track = read_trace(name)
    place = scenario(AREAS_M[name], track.pos_m.shape[1], accel)
    record = fly(jittered(place, 1), track, RecedingHorizonAgent(settings_for(place, fast=True)), 1)
    assert record.metrics.episodic_aoi <= most
    assert not any(record.violations.values())


@pytest.mark.traces
@pytest.mark.parametrize(("name", "about"), [("purdue_59", 19.3), ("ncsu_33", 37.6), ("kaist_92", 26.2)])
def test_random_scores_what_random_should(name: str, about: float) -> None:
    track = read_trace(name)
    place = scenario(AREAS_M[name], track.pos_m.shape[1])
    scores = [fly(jittered(place, s), track, UniformAgent(), s).metrics.episodic_aoi for s in range(1, 6)]
    assert np.mean(scores) == pytest.approx(about, abs=4.0 * np.std(scores) / math.sqrt(5))
