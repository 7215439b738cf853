"""The server's dry runs: one at a time, each in its own process with a limit on its time, the newest few kept.

A process and not a thread: a search that keeps the interpreter busy must not make the flight loop late.
"""

import json
import subprocess
import sys
import threading
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any

from gcs.forecast.estimate import DryRunOrder

KEPT = 16
LIMIT_S = 300.0
WORKER = (sys.executable, "-m", "gcs.forecast.worker")
ROOT = Path(__file__).resolve().parents[2]  # where a bare checkout's packages are found


class DryRunState(StrEnum):
    """How far it is."""

    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(frozen=True)
class DryRun:
    """One dry run as it stands; ``forecast`` as ``gcs.forecast.estimate`` gives it, once it is done."""

    id: str
    name: str
    policy: str
    slots: int
    document: Mapping[str, Any]
    state: DryRunState = DryRunState.RUNNING
    slot: int = 0
    reason: str = ""
    forecast: Mapping[str, Any] | None = None


class Busy(Exception):  # noqa: N818 an ordinary refusal
    """One is running already."""

    def __init__(self, running: DryRun) -> None:
        super().__init__(f'a dry run of "{running.name}" is under way (slot {running.slot} of {running.slots})')
        self.running = running


class DryRuns:
    """Started and asked from any thread."""

    def __init__(self, limit_s: float = LIMIT_S, worker: Sequence[str] = WORKER) -> None:
        self._limit_s, self._worker = limit_s, tuple(worker)
        self._lock = threading.Lock()
        self._runs: dict[str, DryRun] = {}
        self._processes: dict[str, subprocess.Popen[bytes]] = {}
        self._threads: list[threading.Thread] = []

    def start(self, name: str, policy: str, slots: int, order: DryRunOrder) -> DryRun:
        """Begin; raises Busy while another one is running."""
        run = DryRun(uuid.uuid4().hex[:12], name, policy, slots, order.document)
        with self._lock:
            running = next((one for one in self._runs.values() if one.state is DryRunState.RUNNING), None)
            if running is not None:
                raise Busy(running)
            self._runs[run.id] = run
            while len(self._runs) > KEPT:
                self._runs.pop(next(iter(self._runs)))
            process = subprocess.Popen(  # noqa: S603 our own module
                self._worker, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=ROOT
            )
            self._processes[run.id] = process
            thread = threading.Thread(target=self._follow, args=(run.id, process, order), name="dry-run", daemon=True)
            self._threads = [one for one in self._threads if one.is_alive()] + [thread]
        thread.start()
        return run

    def get(self, run_id: str) -> DryRun | None:
        """As it stands now."""
        with self._lock:
            return self._runs.get(run_id)

    def newest(self) -> list[DryRun]:
        """Newest first."""
        with self._lock:
            return list(reversed(self._runs.values()))

    def forecast_for(self, document: Mapping[str, Any]) -> DryRun | None:
        """The newest finished one of exactly this mission."""
        return next((one for one in self.newest() if one.forecast is not None and one.document == document), None)

    def cancel(self, run_id: str, reason: str = "cancelled") -> DryRun | None:
        """End it if it is running; None when there is none of this id."""
        with self._lock:
            run = self._runs.get(run_id)
            if run is None or run.state is not DryRunState.RUNNING:
                return run
            self._runs[run_id] = run = replace(run, state=DryRunState.CANCELLED, reason=reason)
            self._processes[run_id].kill()
        return run

    def close(self) -> None:
        """End what is running and wait for its process."""
        for run in self.newest():
            self.cancel(run.id, "the server stops")
        for thread in self._threads:
            thread.join(10.0)

    def _follow(self, run_id: str, process: "subprocess.Popen[bytes]", order: DryRunOrder) -> None:
        limit = threading.Timer(self._limit_s, self._out_of_time, (run_id,))
        limit.daemon = True
        limit.start()
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(json.dumps(asdict(order)).encode() + b"\n")
            process.stdin.flush()
            for line in process.stdout:
                self._take(run_id, json.loads(line))
        except BrokenPipeError:  # killed, or died at once: what it left says which
            pass
        finally:
            limit.cancel()
            self._over(run_id, process)

    def _take(self, run_id: str, message: Mapping[str, Any]) -> None:
        with self._lock:
            run = self._runs.get(run_id)
            if run is None or run.state is not DryRunState.RUNNING:
                return
            if "done" in message:
                run = replace(run, state=DryRunState.DONE, slot=run.slots, forecast=message["done"])
            elif "failed" in message:
                run = replace(run, state=DryRunState.FAILED, reason=message["failed"])
            else:
                run = replace(run, slot=run.slot + message["slot"])
            self._runs[run_id] = run

    def _out_of_time(self, run_id: str) -> None:
        reason = f"took longer than {self._limit_s:g} s; try fewer slots or a quicker policy"
        with self._lock:
            run = self._runs.get(run_id)
            if run is not None and run.state is DryRunState.RUNNING:
                self._runs[run_id] = replace(run, state=DryRunState.FAILED, reason=reason)
                self._processes[run_id].kill()

    def _over(self, run_id: str, process: "subprocess.Popen[bytes]") -> None:
        process.communicate()  # closes the pipes, also those that a killed process left full, and waits
        with self._lock:
            self._processes.pop(run_id, None)
            run = self._runs.get(run_id)
            if run is not None and run.state is DryRunState.RUNNING:
                reason = f"the dry run's process ended by itself ({process.returncode}); the server's log says more"
                self._runs[run_id] = replace(run, state=DryRunState.FAILED, reason=reason)
