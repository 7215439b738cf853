"""Where results come from: the lines at their head."""

import importlib.metadata
import os
import platform
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from policy.evaluation.tables.sources import code_version

LIBRARIES = ("numpy", "numba", "onnxruntime", "matplotlib", "ray")


@dataclass(frozen=True)
class Provenance:
    """Everything that the reader needs to get the same figures again."""

    command: str
    date_utc: str
    machine: str
    versions: str
    commit: str
    code: str

    @classmethod
    def now(cls, command: str, date_utc: str) -> "Provenance":
        """Of this run, on this machine."""
        return cls(command, date_utc, machine(), versions(), commit(), code_version())

    def lines(self) -> Sequence[str]:
        """Markdown list items."""
        return (
            f"- Command: `{self.command}`",
            f"- Date: {self.date_utc}",
            f"- Machine: {self.machine}",
            f"- Versions: {self.versions}",
            f"- Sources: commit {self.commit}; digest of what decides a campaign {self.code}",
        )


def machine() -> str:
    """Processor, cores, memory, system; no host name."""
    memory_gib = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    return f"{_processor()}, {os.cpu_count()} cores, {memory_gib:.0f} GiB, {platform.system()} {platform.machine()}"


def versions() -> str:
    """Python and the libraries that matter, where they are installed."""
    return ", ".join(
        [f"Python {platform.python_version()}", *(f"{name} {v}" for name in LIBRARIES if (v := _of(name)))]
    )


def commit() -> str:
    """Of the clone that ran, with ``-dirty`` where it had changes; ``unknown`` outside of one."""
    try:
        answer = subprocess.run(
            ["git", "describe", "--always", "--dirty", "--abbrev=12"],  # noqa: S607 - whichever git the user has
            cwd=Path(__file__).parent,
            capture_output=True,
            text=True,
            check=True,
            timeout=10,
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return answer.stdout.strip()


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown processor"


def _of(library: str) -> str | None:
    try:
        return importlib.metadata.version(library)
    except importlib.metadata.PackageNotFoundError:
        return None
