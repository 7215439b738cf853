"""Fault scripts for the mock, as rows: kind, vehicle (0: all), begin, length (None: to the end), value, direction."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

Row = tuple[str, int, float, float | None, float | None, str]

BAD_LINK: tuple[Row, ...] = (
    ("loss", 0, 20.0, None, 0.3, "both"),
    ("jitter", 0, 20.0, None, 0.3, "both"),
    ("duplicate", 0, 20.0, None, 0.2, "both"),
    ("reorder", 0, 20.0, None, 0.2, "both"),
)


def write(path: Path, rows: Sequence[Row]) -> Path:
    """As the TOML file that the mock reads."""
    parts = []
    for kind, vehicle, at_s, for_s, value, direction in rows:
        part = f'[[fault]]\nkind = "{kind}"\nvehicle = {vehicle}\nat_s = {at_s:.2f}\ndirection = "{direction}"\n'
        part += f"for_s = {for_s:.2f}\n" if for_s is not None else ""
        parts.append(part + (f"value = {value:.3f}\n" if value is not None else ""))
    path.write_text("\n".join(parts))
    return path


def random_bad_link(rng: np.random.Generator, uavs: int) -> list[Row]:
    """Loss to 30 %, jitter to 0.3 s, duplicates, reordering, and cuts to 5 s of either way at any time."""
    rows: list[Row] = [
        ("loss", 0, 20.0, None, float(rng.uniform(0.0, 0.3)), "both"),
        ("jitter", 0, 20.0, None, float(rng.uniform(0.0, 0.3)), "both"),
        ("duplicate", 0, 20.0, None, float(rng.uniform(0.0, 0.3)), "both"),
        ("reorder", 0, 20.0, None, float(rng.uniform(0.0, 0.3)), "both"),
    ]
    for vehicle in range(1, uavs + 1):
        for at_s in np.sort(rng.uniform(20.0, 300.0, int(rng.integers(1, 6)))):
            way = str(rng.choice(["both", "up", "down"]))
            rows.append(("cut", vehicle, float(at_s), float(rng.uniform(0.5, 5.0)), None, way))
    return rows
