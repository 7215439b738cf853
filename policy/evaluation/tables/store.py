"""Finished cells on disk: one file a cell, whole or absent, so that a run goes on where the last one ended."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from policy.evaluation.files import OutputError, write_text


@dataclass(frozen=True)
class CellStore:
    """The folder ``cells`` of a results folder."""

    folder: Path

    @classmethod
    def create(cls, out: Path) -> "CellStore":
        """Make the folder where it is missing. Raises OutputError."""
        folder = out / "cells"
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"{out}: cannot be made a results folder: {error.strerror or error}") from error
        return cls(folder)

    def read(self, key: str) -> dict[str, Any] | None:
        """What the cell holds; None where it is yet to be flown, or its file is not a cell's (it is flown again)."""
        cell = _read(self.folder / f"{key}.json")
        return cell if cell is not None and cell.get("key") == key else None

    def write(self, cell: Mapping[str, Any]) -> None:
        """Keep a finished cell, at once. Raises OutputError."""
        write_text(self.folder / f"{cell['key']}.json", json.dumps(cell, allow_nan=False) + "\n")

    def all(self) -> Iterator[dict[str, Any]]:
        """Every cell of every run, in the order of their keys."""
        for path in sorted(self.folder.glob("*.json")):
            cell = _read(path)
            if cell is not None and cell.get("key") == path.stem:
                yield cell


def _read(path: Path) -> dict[str, Any] | None:
    try:
        cell = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise OutputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except ValueError:  # damaged, as by a disk that was pulled
        return None
    return cell if isinstance(cell, dict) else None
