"""Plain processes that do jobs, one thread each. A worker that dies costs only the job that it was doing."""

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import wait as wait_for
from typing import Any, Protocol

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
TRIES_ALONE = 2
"""Times that a job is tried by itself after a worker died with it."""


class Job(Protocol):
    """What a worker is sent; it must survive pickling."""

    @property
    def key(self) -> str:
        """Of the file that keeps its result."""


Work = Callable[[Any], dict[str, Any]]
"""A function of a module, from a job to what its file holds."""


@dataclass(frozen=True)
class Finished:
    """A job that ended well."""

    job: Job
    cell: Mapping[str, Any]


@dataclass(frozen=True)
class Failed:
    """A job that kills its workers."""

    job: Job
    reason: str


Outcome = Finished | Failed


def in_processes(jobs: Sequence[Job], work: Work, workers: int) -> Iterator[Outcome]:
    """Do ``jobs`` on ``workers`` processes, in the order in which they end.

    When a worker dies, the pool takes all that it was doing down with it; those few are then tried one by one, so that
    only the one to blame is given up.
    """
    waiting, suspects = deque(jobs), deque[Job]()
    while waiting:
        yield from _until_broken(waiting, work, workers, suspects)
        while suspects:
            yield _alone(suspects.popleft(), work)


def _until_broken(waiting: deque[Job], work: Work, workers: int, suspects: deque[Job]) -> Iterator[Outcome]:
    """Take from ``waiting`` until it is empty or a worker died; what was in flight then goes to ``suspects``."""
    with _pool(min(workers, len(waiting))) as pool:
        running: dict[Future[dict[str, Any]], Job] = {}
        while (waiting and not suspects) or running:
            while waiting and not suspects and len(running) < workers:
                job = waiting.popleft()
                try:
                    running[pool.submit(work, job)] = job
                except BrokenProcessPool:
                    suspects.append(job)
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                job = running.pop(future)
                try:
                    yield Finished(job, future.result())
                except BrokenProcessPool:
                    suspects.append(job)


def _alone(job: Job, work: Work) -> Outcome:
    for _ in range(TRIES_ALONE):
        with _pool(1) as pool:
            try:
                return Finished(job, pool.submit(work, job).result())
            except BrokenProcessPool:
                continue
    return Failed(job, "its worker died each time, perhaps for want of memory")


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    context = multiprocessing.get_context("spawn")
    with one_thread(), ProcessPoolExecutor(workers, context, initializer=_begin_worker) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


@contextmanager
def one_thread() -> Iterator[None]:
    """Processes started inside get one thread: numerical libraries read these when they are loaded."""
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _begin_worker() -> None:
    """End quietly on Ctrl-C, and when the parent is gone: an orphan would fly for nobody."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait_for([parent.sentinel])
        os._exit(1)
