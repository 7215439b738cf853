"""The same work on Ray: this machine's cores, or a cluster's. Ray comes with the ``scale`` extra and is imported here.

Workers send cells back and only this process writes them, so a cluster needs no shared folder; the checkpoints of
``--checkpoints`` must be at the same path on every machine, the shipped ones travel with the package.
"""

import importlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from policy.evaluation.tables.workers import THREAD_VARIABLES, Failed, Finished, Job, Outcome, Work

LOCAL = "local"
TRIES = 3
"""Times that Ray starts a cell whose worker or machine died."""
AHEAD = 2
"""Cells in flight for each core: while one is flown the next is on its way."""
UNREACHABLE_HINT = "one that wants a token needs RAY_AUTH_MODE=token here"
_PACKAGE = Path(__file__).resolve().parents[2]


class RayError(RuntimeError):
    """Ray is not installed, or there is no cluster at the address: one line."""


def on_ray(jobs: Sequence[Job], work: Work, address: str, workers: int) -> Iterator[Outcome]:
    """Do ``jobs`` on the cluster at ``address``; ``local`` starts one of ``workers`` cores here. Raises RayError."""
    ray = _import_ray()
    _connect(ray, address, workers)
    try:
        remote = ray.remote(num_cpus=1, max_retries=TRIES - 1)(work)
        in_flight = AHEAD * max(1, int(ray.cluster_resources().get("CPU", workers)))
        yield from _fly(ray, remote, jobs, in_flight)
    finally:
        ray.shutdown()


def _import_ray() -> Any:
    try:
        return importlib.import_module("ray")
    except ImportError as error:
        raise RayError("--ray needs the [scale] extra: pip install 'uav-crowdsensing[scale]'") from error


def _connect(ray: Any, address: str, workers: int) -> None:
    environment: dict[str, Any] = {"env_vars": dict.fromkeys(THREAD_VARIABLES, "1")}
    quiet: dict[str, Any] = {"log_to_driver": False, "logging_level": "error"}
    if address == LOCAL:
        ray.init(address=LOCAL, num_cpus=workers, include_dashboard=False, runtime_env=environment, **quiet)
        return
    environment["py_modules"] = [str(_PACKAGE)]
    try:
        ray.init(address=address, runtime_env=environment, **quiet)
    except (ConnectionError, ValueError, RuntimeError) as error:
        raise RayError(f"--ray {address}: no Ray cluster answers there ({UNREACHABLE_HINT}): {error}") from error


def _fly(ray: Any, remote: Any, jobs: Sequence[Job], in_flight: int) -> Iterator[Outcome]:
    waiting, running = iter(jobs), dict[Any, Job]()
    while True:
        while len(running) < in_flight and (job := next(waiting, None)) is not None:
            running[remote.remote(job)] = job
        if not running:
            return
        done, _ = ray.wait(list(running), num_returns=1)
        for reference in done:
            yield _outcome(ray, reference, running.pop(reference))


def _outcome(ray: Any, reference: Any, job: Job) -> Outcome:
    """A defect in the work itself is raised here as it is in plain processes."""
    try:
        return Finished(job, ray.get(reference))
    except (ray.exceptions.WorkerCrashedError, ray.exceptions.NodeDiedError, ray.exceptions.OutOfMemoryError) as error:
        return Failed(job, f"its worker died {TRIES} times: {type(error).__name__}")
