"""Whatever a command wrote, as one table for a notebook: ``load_table("result.json")``."""

import importlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from policy.evaluation.results import METRIC_NAMES


class TableError(ValueError):
    """A file that holds no results: one line."""


def load_table(*paths: Path | str) -> Any:
    """A pandas DataFrame of all ``paths``, one below the other; several get a column ``file``.

    Result objects (``--json``) and ``report.json`` give one row a seed, trajectories (``--trajectory``) one a UAV or
    user and slot, a folder of ``policy tables`` one a campaign. Raises TableError, and ImportError without pandas.
    """
    pandas = importlib.import_module("pandas")
    frames = [_frame(Path(path), pandas) for path in paths]
    if not frames:
        raise TableError("load_table: name at least one file")
    if len(frames) == 1:
        return frames[0]
    return pandas.concat([frame.assign(file=str(path)) for frame, path in zip(frames, paths, strict=True)]).reset_index(
        drop=True
    )


def result_rows(document: Mapping[str, Any]) -> list[dict[str, Any]]:
    """A result object as flat rows, one a seed."""
    spread = {name: _values(document[name]) for name in METRIC_NAMES if name in document}
    if not spread:
        raise TableError("there are no metrics in it")
    fixed = {name: document.get(name) for name in ("mission", "policy", "uavs", "mcl_db", "slots")}
    decision = {f"decision_{name}_ms": value for name, value in (document.get("decision_ms") or {}).items()}
    broken = {f"violations_{name}": value for name, value in (document.get("violations") or {}).items()}
    seeds = max(len(values) for values in spread.values())
    return [
        {**fixed, "seed": seed, **{name: values[seed] for name, values in spread.items()}, **decision, **broken}
        for seed in range(seeds)
    ]


def _values(metric: Any) -> list[float | None]:
    return list(metric["values"]) if isinstance(metric, Mapping) else [metric]


def _frame(path: Path, pandas: Any) -> Any:
    if path.is_dir():
        rows = importlib.import_module("policy.evaluation.tables").load_results(path)
        if not rows:
            raise TableError(f"{path}: no campaigns of `policy tables` in it")
        return pandas.DataFrame(rows)
    try:
        if path.suffix == ".csv":
            return pandas.read_csv(path, dtype={"id": str})
        return pandas.DataFrame(result_rows(json.loads(path.read_text("utf-8"))))
    except OSError as error:
        raise TableError(f"{path}: cannot be read: {error.strerror}") from error
    except (ValueError, TypeError, AttributeError, KeyError) as error:
        raise TableError(f"{path}: holds no results that this version knows: {error}") from error
