"""What a campaign file says, once it has been checked."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from policy.mission_file.key_lines import KeyPath, dotted, line_of
from policy.world.scenario import Scenario


class MissionError(ValueError):
    """A campaign file that cannot be flown: one line that says what, where and how to mend it."""


@dataclass(frozen=True)
class Source:
    """Where a document came from, so that a complaint can name the key and the line."""

    origin: str = "mission"
    text: str | None = None

    def fail(self, key: KeyPath, message: str) -> NoReturn:
        """Raise the one-line error about ``key``."""
        line = line_of(self.text, key) if self.text is not None else None
        place = f"{self.origin}:{line}" if line is not None else self.origin
        where = f"{place}: {dotted(key)}" if key else place
        raise MissionError(" ".join(f"{where}: {message}".split()))


@dataclass(frozen=True)
class UserSource:
    """Where the users' places come from."""

    kind: str  # trace | walkers | live
    trace: str | None = None
    walkers: int = 0
    seed: int = 0
    preset: str | None = None
    live: int = 0  # the most users that may join a live campaign


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
    source: Source = field(default_factory=Source)
    warnings: tuple[str, ...] = ()  # what may go wrong in flight without being an error
