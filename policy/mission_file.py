"""Campaign files (TOML): read, checked, turned into a :class:`Mission`."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from policy.world.scenario import Scenario


@dataclass(frozen=True)
class UserSource:
    """Where the users' places come from."""

    kind: str  # trace | walkers | live
    trace: str | None = None
    walkers: int = 0
    seed: int = 0
    preset: str | None = None


@dataclass(frozen=True)
class Mission:
    """A checked campaign file. ``scenario.collect_mbps`` has one value a user once the users are known."""

    name: str
    scenario: Scenario
    users: UserSource
    policy: str
    checkpoint: str | None
    preset: str  # fresh | balanced
    document: Mapping[str, Any]  # as written, for the records
    directory: Path | None  # where the file lay: traces are looked for beside it


class MissionError(ValueError):
    """A campaign file that cannot be flown: one line that says what, where and how to mend it."""
