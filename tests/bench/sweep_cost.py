"""What `python -m policy tables` costs: campaigns a minute on processes and on Ray, memory, seconds of a campaign by
method, and from these how long all that is flown takes on 1, 16 and 256 cores. Prints Markdown.

    python tests/bench/sweep_cost.py --only throughput
    python tests/bench/sweep_cost.py --only grid --checkpoints NETS
"""

import argparse
import os
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"))  # before NumPy is loaded
sys.path.insert(0, str(Path(__file__).parent))

import psutil
from sweep_estimate import table
from sweep_grid import grid_cost

from policy.evaluation.tables.campuses import Campus, find_campus
from policy.evaluation.tables.cells import Point, fly_task
from policy.evaluation.tables.grid import BASE_MCL_DB, BASE_UAVS
from policy.evaluation.tables.methods import Method
from policy.evaluation.tables.paper import CAMPUSES
from policy.evaluation.tables.ray_workers import LOCAL, on_ray
from policy.evaluation.tables.sweep import make_tasks
from policy.evaluation.tables.workers import Job, Outcome, Work, in_processes

SAMPLE_S = 0.2
FLOWN = ("gcrl", "receding-horizon", "random")
"""For throughput: what needs no network of one's own."""
EMPTY_JOBS = 200
Do = Callable[[Sequence[Job], Work, int], Iterator[Outcome]]
WAYS: dict[str, Do] = {
    "plain processes": in_processes,
    "Ray": lambda jobs, work, workers: on_ray(jobs, work, LOCAL, workers),
}


def main() -> None:
    """Measure the parts asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--only", choices=("throughput", "grid"), action="append", help="may be repeated")
    parser.add_argument("--seeds", type=int, default=8, help="of each of the three methods, for throughput")
    parser.add_argument("--checkpoints", type=Path, help="the rivals' networks, as for `policy tables`")
    options = parser.parse_args()
    there = [c for c in (find_campus(name, None) for name in CAMPUSES) if isinstance(c, Campus)]
    demo = find_campus("demo", None)
    campuses = there or [c for c in [demo] if isinstance(c, Campus)]
    warnings.simplefilter("ignore")  # of Ray's own
    if "throughput" in (options.only or ["throughput"]):
        print(throughput(campuses[0], options.seeds))
    if "grid" in (options.only or ["grid"]):
        print(grid_cost({campus.name: campus for campus in campuses}, options.checkpoints))


@dataclass
class Memory:
    """Greatest sum of resident memory of this process and all below it, while the block runs."""

    peak_b: int = 0
    processes: int = 0
    _end: threading.Event = field(default_factory=threading.Event)

    def __enter__(self) -> "Memory":
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()

    def _watch(self) -> None:
        me = psutil.Process()
        while not self._end.wait(SAMPLE_S):
            resident_b = []
            for process in (me, *me.children(recursive=True)):
                try:
                    resident_b.append(process.memory_info().rss)
                except psutil.Error:  # it has ended
                    continue
            if sum(resident_b) > self.peak_b:
                self.peak_b, self.processes = sum(resident_b), len(resident_b)


def throughput(campus: Campus, seeds: int) -> str:
    """The same campaigns on one and two workers, in plain processes and on Ray."""
    points = [Point(campus.name, Method(name), BASE_UAVS, BASE_MCL_DB) for name in FLOWN]
    tasks = make_tasks(points, {campus.name: campus}, seeds)
    list(in_processes(tasks[:: max(1, seeds)], fly_task, 1))  # what is compiled on a first flight is then on disk
    rows = []
    for name, do in WAYS.items():
        for workers in (1, 2):
            with Memory() as memory:
                wall_s = _took_s(do, tasks, fly_task, workers)
            one_s, many_s = (_took_s(do, [tasks[0]] * n, nothing, workers) for n in (1, EMPTY_JOBS))
            rows.append(
                (
                    *(name, str(workers), f"{60.0 * len(tasks) / wall_s:.0f}", f"{wall_s:.1f} s", f"{one_s:.1f} s"),
                    *(f"{1e3 * (many_s - one_s) / (EMPTY_JOBS - 1):.1f} ms", f"{memory.peak_b / 2**20:.0f} MiB"),
                    str(memory.processes),
                )
            )
    head = [
        *("on", "workers", "campaigns a minute", f"{len(tasks)} campaigns", "one empty job"),
        *("each further one", "memory", "processes"),
    ]
    return table(head, rows)


def _took_s(do: Do, jobs: Sequence[Job], work: Work, workers: int) -> float:
    begun_s = time.perf_counter()
    done = len(list(do(jobs, work, workers)))
    if done != len(jobs):
        raise RuntimeError(f"{done} of {len(jobs)} jobs came back")
    return time.perf_counter() - begun_s


def nothing(job: Job) -> dict[str, object]:
    """An empty job: only its way there and back."""
    return {"key": job.key}


if __name__ == "__main__":
    main()
