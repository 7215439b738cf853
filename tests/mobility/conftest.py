"""Real traces where they are at hand, and small files written by tests."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from policy.mobility.presets import REAL_SETS
from policy.mobility.reader import DATA_DIR_VARIABLE, DEFAULT_DATA_DIR, read_traces
from policy.mobility.traces import UserTraces

WriteCsv = Callable[[str], Path]


@pytest.fixture
def write_csv(tmp_path: Path) -> WriteCsv:
    """Text to a trace file."""

    def write(text: str) -> Path:
        path = tmp_path / "users.csv"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.fixture(scope="session")
def real_traces() -> dict[str, UserTraces]:
    """The three real sets by file name; tests that use them are skipped only where the files are absent."""
    folder = Path(os.environ.get(DATA_DIR_VARIABLE) or DEFAULT_DATA_DIR)
    missing = [real.file for real in REAL_SETS if not (folder / real.file).is_file()]
    if missing:
        pytest.skip(f"no {', '.join(missing)} in {folder}: set {DATA_DIR_VARIABLE}")
    return {
        real.file: read_traces(folder / real.file, area_size_m=real.area_size_m, num_samples=121, slot_s=15.0)
        for real in REAL_SETS
    }
