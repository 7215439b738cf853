"""Does what is not on disk yet, and keeps each result the moment it is there."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from policy.evaluation.tables.campuses import Campus
from policy.evaluation.tables.cells import Point, Task, make_task
from policy.evaluation.tables.store import CellStore
from policy.evaluation.tables.workers import Failed, Job, Outcome

Do = Callable[[Sequence[Job]], Iterable[Outcome]]
"""Does jobs, in any order: processes or Ray, chosen by the command."""
Cells = Mapping[Point, Sequence[Mapping[str, Any]]]
"""Of each point its cells in the order of the seeds."""


@dataclass(frozen=True)
class Sweep:
    """What came of a run."""

    done: int
    kept: int  # found on disk
    failed: tuple[Failed, ...]


def make_tasks(points: Iterable[Point], campuses: Mapping[str, Campus], seeds: int) -> tuple[Task, ...]:
    """One task a cell. Raises MissionError where a campaign cannot be flown so."""
    return tuple(make_task(campuses[point.campus], point, seed) for point in points for seed in range(seeds))


def lacking(jobs: Sequence[Job], store: CellStore) -> tuple[Job, ...]:
    """What is yet to be done."""
    return tuple(job for job in jobs if store.read(job.key) is None)


def sweep(jobs: Sequence[Job], store: CellStore, do: Do, on_outcome: Callable[[Outcome], None]) -> Sweep:
    """Do the jobs that ``store`` lacks. Raises OutputError where a result cannot be kept."""
    todo, failed = lacking(jobs, store), []
    for outcome in do(todo) if todo else ():
        if isinstance(outcome, Failed):
            failed.append(outcome)
        else:
            store.write(outcome.cell)
        on_outcome(outcome)
    return Sweep(len(todo) - len(failed), len(jobs) - len(todo), tuple(failed))


def collect(tasks: Iterable[Task], store: CellStore) -> Cells:
    """The cells that are there."""
    cells: dict[Point, list[Mapping[str, Any]]] = {}
    for task in tasks:
        if (cell := store.read(task.key)) is not None:
            cells.setdefault(task.point, []).append(cell)
    return cells
