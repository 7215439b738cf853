"""The same cells on Ray, for real: two workers on this machine."""

import importlib
import warnings
from pathlib import Path

import pytest
from tables_jobs import Note, done, jot

from policy.evaluation.tables.campuses import find_campus
from policy.evaluation.tables.cells import Point, fly_task, make_task
from policy.evaluation.tables.methods import Method
from policy.evaluation.tables.ray_workers import LOCAL, RayError, on_ray
from policy.evaluation.tables.workers import Finished

CLOCKED = ("decision_ms", "wall_s", "finished_utc")


def untimed(cell):
    return {name: value for name, value in cell.items() if name not in CLOCKED}


@pytest.fixture(autouse=True)
def ray_warns_of_itself():
    """Ray's own deprecations and unclosed sockets are not ours to mend."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def test_two_ray_workers_fly_the_same_cells_and_one_that_dies_is_replaced(tiny, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))  # so that workers find this module
    campus = find_campus(str(tiny), None)
    tasks = [make_task(campus, Point("tiny", Method("random"), 2, 117.0), seed) for seed in range(3)]
    mortal = Note("mortal", tmp_path, deaths=1)

    outcomes = list(on_ray([*tasks, mortal], fly_or_jot, LOCAL, workers=2))

    assert all(isinstance(outcome, Finished) for outcome in outcomes)
    flown = {outcome.job.key: outcome.cell for outcome in outcomes if isinstance(outcome, Finished)}
    for task in tasks:
        assert untimed(flown[task.key]) == untimed(fly_task(task))
    assert flown["mortal"]["threads"] == "1"
    assert done(tmp_path) == ["mortal", "mortal"]


def fly_or_jot(job):
    return jot(job) if isinstance(job, Note) else fly_task(job)


def test_no_cluster_at_the_address_is_one_line():
    with pytest.raises(RayError, match="no Ray cluster answers"):
        list(on_ray([], fly_task, "nonsense://x", workers=1))


def test_without_ray_one_line_says_what_to_install(monkeypatch):
    real = importlib.import_module

    def without(name, package=None):
        if name == "ray":
            raise ModuleNotFoundError(name)
        return real(name, package)

    monkeypatch.setattr(importlib, "import_module", without)
    with pytest.raises(RayError, match=r"\[scale\]"):
        list(on_ray([], fly_task, LOCAL, workers=1))
