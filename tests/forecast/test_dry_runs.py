"""Dry runs in their own processes: followed, bounded, ended."""

import sys
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from test_estimate import MISSION

from gcs.forecast.dry_runs import Busy, DryRun, DryRuns, DryRunState
from gcs.forecast.estimate import DryRunOrder, estimate

ORDER = DryRunOrder(MISSION, None, 10.0, 3.0)
WAIT_S = 30.0
SLEEPY = (sys.executable, "-c", "import sys, time; sys.stdin.readline(); time.sleep(60)")
BROKEN = (sys.executable, "-c", "import sys; sys.stdin.readline(); sys.exit(3)")


@pytest.fixture
def make() -> Iterator[Callable[..., DryRuns]]:
    made: list[DryRuns] = []

    def build(**words: Any) -> DryRuns:
        made.append(DryRuns(**words))
        return made[-1]

    yield build
    for one in made:
        one.close()


def start(runs: DryRuns, order: DryRunOrder = ORDER) -> DryRun:
    return runs.start("small", "random", 5, order)


def ended(runs: DryRuns, run: DryRun) -> DryRun:
    deadline_s = time.monotonic() + WAIT_S
    while (now := runs.get(run.id)) is not None and now.state is DryRunState.RUNNING:
        assert time.monotonic() < deadline_s, "the dry run does not end"
        time.sleep(0.02)
    assert now is not None
    return now


def test_a_dry_run_ends_with_the_forecast_of_this_very_mission(make: Callable[..., DryRuns]):
    runs = make()
    done = ended(runs, start(runs))
    assert (done.state, done.slot) == (DryRunState.DONE, 5)
    assert done.forecast is not None
    assert done.forecast["metrics"] == estimate(ORDER)["metrics"]
    assert runs.forecast_for(dict(MISSION)) == done
    assert runs.forecast_for(MISSION | {"policy": {"name": "gcrl"}}) is None


def test_a_mission_that_cannot_be_flown_says_why(make: Callable[..., DryRuns]):
    runs = make()
    failed = ended(runs, start(runs, DryRunOrder(MISSION | {"policy": {"name": "muzero"}}, None, 10.0, 3.0)))
    assert failed.state is DryRunState.FAILED
    assert "muzero" in failed.reason


def test_one_at_a_time_until_it_is_cancelled(make: Callable[..., DryRuns]):
    runs = make(worker=SLEEPY)
    first = start(runs)
    with pytest.raises(Busy) as busy:
        start(runs)
    assert busy.value.running == first
    cancelled = runs.cancel(first.id, "cancelled by me")
    assert cancelled is not None
    assert (cancelled.state, cancelled.reason) == (DryRunState.CANCELLED, "cancelled by me")
    assert start(runs).id != first.id
    assert runs.cancel("nothing") is None


def test_one_that_takes_too_long_is_ended(make: Callable[..., DryRuns]):
    runs = make(worker=SLEEPY, limit_s=0.2)
    late = ended(runs, start(runs))
    assert late.state is DryRunState.FAILED
    assert "longer than 0.2 s" in late.reason


def test_a_process_that_dies_is_told_as_a_defect(make: Callable[..., DryRuns]):
    runs = make(worker=BROKEN)
    dead = ended(runs, start(runs))
    assert dead.state is DryRunState.FAILED
    assert "(3)" in dead.reason


def test_the_newest_few_are_kept(make: Callable[..., DryRuns]):
    runs = make(worker=BROKEN)
    ids = [ended(runs, start(runs)).id for _ in range(18)]
    assert [run.id for run in runs.newest()] == ids[:1:-1]
