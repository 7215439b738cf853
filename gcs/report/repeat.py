"""Everything needed to fly a campaign again: versions, sources, digests of the deciding files, and its mission."""

import contextlib
import hashlib
import importlib.metadata
import platform
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import tomli_w

from gcs.report.data import Provenance
from policy.agents.registry import LEARNED
from policy.evaluation.tables.provenance import commit, machine
from policy.mission_file import Mission
from policy.mobility.reader import find_trace
from policy.mobility.traces import TraceError
from policy.model.checkpoint import find_checkpoint
from policy.model.checkpoint_error import CheckpointError

DEFAULT_POLICY = "gcrl"  # whose network is the shipped default
LIBRARIES = ("uav-crowdsensing", "numpy", "numba", "onnxruntime", "pymavlink")


def provenance(mission: Mission, *, policy: str, checkpoint: str | None, repeat: str = "", **facts: Any) -> Provenance:
    """Of this process; ``facts`` are further fields of :class:`Provenance`."""
    return Provenance(
        mission=mission_as_flown(mission, policy, checkpoint),
        checkpoint=checkpoint or "",
        repeat=repeat,
        versions=versions(),
        machine=_machine(),
        commit=_commit(),
        sha256=digests(mission, policy, checkpoint),
        **facts,
    )


def mission_as_flown(mission: Mission, policy: str, checkpoint: str | None) -> dict[str, Any]:
    """The mission's document, naming the policy that really flew."""
    chosen = {"name": policy} | ({"checkpoint": checkpoint} if checkpoint else {})
    return {**mission.document, "policy": chosen}


def mission_toml(document: Mapping[str, Any]) -> str:
    """A mission file that says what the document says. JSON's null, which TOML lacks, is a key left out."""
    return tomli_w.dumps(_without_null(document))


def digests(mission: Mission, policy: str, checkpoint: str | None) -> dict[str, str]:
    """SHA-256 of the trace and of the exported network; files that are gone by now are left out."""
    files: list[Path] = []
    if mission.users.trace is not None:
        with contextlib.suppress(TraceError):
            files.append(find_trace(mission.users.trace, mission.directory))
    if policy in LEARNED and (checkpoint or policy == DEFAULT_POLICY):
        with contextlib.suppress(CheckpointError):
            files.append(find_checkpoint(checkpoint).graph)
    return {file.name: _sha256(file) for file in files if file.is_file()}


def versions() -> dict[str, str]:
    """Python, this package and the libraries that decide results."""
    found = {"python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found


def _sha256(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()


def _without_null(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _without_null(entry) for key, entry in value.items() if entry is not None}
    if isinstance(value, list | tuple):
        return [_without_null(entry) for entry in value if entry is not None]
    return value


@cache
def _commit() -> str:
    return commit()


@cache
def _machine() -> str:
    return machine()
