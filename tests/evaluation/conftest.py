"""A mission on a small trace of its own, written as files."""

import csv
from pathlib import Path

import numpy as np
import pytest

SLOTS = 12
USERS = 9
SIZE_M = (1200.0, 900.0)

MISSION = """\
[campaign]
name = "tiny"
slots = 12
slot_s = 15.0
[area]
south_west = [47.0, 8.0]
size_m = [1200.0, 900.0]
obstacles = [ { name = "tower", height_m = 140.0, polygon_m = [[300.0, 300.0], [360.0, 300.0], [360.0, 380.0]] } ]
[fleet]
uavs = 2
launch_m = [600.0, 450.0]
[users]
source = "trace"
trace = "tiny.csv"
collect_mbps = 0.03
[policy]
name = "random"
"""


def wanderers(seed: int = 3) -> np.ndarray:
    """Users' places [T+1, M, 2]: a random walk that stays inside."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(0.0, 15.0, size=(SLOTS + 1, USERS, 2))
    steps[0] = rng.uniform((100.0, 100.0), (1100.0, 800.0), size=(USERS, 2))
    return np.clip(np.cumsum(steps, axis=0), 0.0, SIZE_M)


def write_trace(path: Path, pos_m: np.ndarray) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["id", "timestamp", "x_distance", "y_distance"])
        for sample, places in enumerate(pos_m):
            writer.writerows(
                [user, 1000 + 15 * sample, *map(repr, map(float, place))] for user, place in enumerate(places)
            )


@pytest.fixture
def tiny(tmp_path: Path) -> Path:
    """The mission file, its trace beside it."""
    write_trace(tmp_path / "tiny.csv", wanderers())
    path = tmp_path / "tiny.toml"
    path.write_text(MISSION)
    return path
