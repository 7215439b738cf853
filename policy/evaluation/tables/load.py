"""Results for notebooks: ``rows = load_results("docs/results")``."""

import importlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from policy.evaluation.tables.campuses import canonical
from policy.evaluation.tables.store import CellStore

NAMES = ("campus", "policy", "network", "options")
TOLD_APART = (*NAMES, "uavs", "mcl_db", "slots", "seed")


def load_results(folder: Path | str) -> list[dict[str, Any]]:
    """One flat row a campaign, of all runs into ``folder``, also of one that has not ended.

    Where a campaign was flown again under changed sources or weights, the newest counts. ``options`` is JSON text.
    """
    newest: dict[tuple[Any, ...], dict[str, Any]] = {}
    for cell in CellStore(Path(folder) / "cells").all():
        if "metrics" not in cell:
            continue
        row = flat_row(cell)
        told_apart = tuple(str(row[name]) if name in NAMES else row[name] for name in TOLD_APART)
        before = newest.get(told_apart)
        if before is None or before["finished_utc"] <= row["finished_utc"]:
            newest[told_apart] = row
    return [newest[told_apart] for told_apart in sorted(newest)]


def load_frame(folder: Path | str) -> Any:
    """The same rows as a pandas DataFrame; ImportError where pandas is not installed."""
    return importlib.import_module("pandas").DataFrame(load_results(folder))


def flat_row(cell: Mapping[str, Any]) -> dict[str, Any]:
    """A campaign's cell without nesting and without paths."""
    return {
        **{name: cell[name] for name in ("campus", "policy", "network", "uavs", "mcl_db", "slots", "seed")},
        **cell["metrics"],
        **{f"decision_{name}_ms": value for name, value in cell["decision_ms"].items()},
        **{f"violations_{name}": value for name, value in cell["violations"].items()},
        "options": canonical(cell["options"]),
        **{name: cell[name] for name in ("checkpoint_sha256", "code", "wall_s", "finished_utc", "key")},
    }
