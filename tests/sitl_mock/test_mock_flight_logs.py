"""The motion model fed with the commands of real ArduCopter logs (docs/mock.md has the figures by phase)."""

from __future__ import annotations

import csv
import gzip
import os
from dataclasses import replace
from math import nan, radians
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from sitl_mock.physics.fleet import TICK_S, Fleet
from sitl_mock.physics.vehicle import ARDUQUAD

LOGS = Path(os.environ.get("UCS_FLIGHT_DIR", Path(__file__).parents[2].parent / "shared" / "data" / "flight"))
GUID_TIMEOUT_S = 3.0
Array = NDArray[np.float64]

pytestmark = pytest.mark.skipif(not LOGS.is_dir(), reason="flight logs not at hand (UCS_FLIGHT_DIR)")


def replay(name: str, lean_deg: float) -> tuple[Array, Array, Array, Array]:
    """Flies the log's commands; velocities and positions [T, 3], ours and the log's."""
    with gzip.open(LOGS / name, "rt", newline="") as file:
        rows = list(csv.DictReader(file))
    start = next(i for i, row in enumerate(rows) if row["phase"] == "hover")
    stop = next(i for i, row in enumerate(rows) if row["phase"] == "rtl")
    rows = rows[start:stop]

    def columns(*names: str) -> Array:
        return np.array([[float(row[name]) for name in names] for row in rows])

    t_s = columns("t_boot_s")[:, 0]
    command = columns("cmd_vn", "cmd_ve", "cmd_vd")
    lost = np.array([row["phase"] == "no_setpoints" for row in rows])
    command[lost & (t_s >= t_s[lost][0] + GUID_TIMEOUT_S)] = 0.0
    true_vel, true_pos = columns("true_vn", "true_ve", "true_vd"), columns("x_n", "y_e", "z_d")
    fleet = Fleet([replace(ARDUQUAD, max_lean_rad=radians(lean_deg))])
    fleet.place(true_pos[:1], np.zeros((1, 3)))
    ticks = np.diff(np.round((t_s - t_s[0]) / TICK_S).astype(int), append=0)
    vel, pos = np.empty_like(true_vel), np.empty_like(true_pos)
    for k in range(len(t_s)):
        vel[k], pos[k] = fleet.vel_ned_mps[0], fleet.pos_ned_m[0]
        fleet.command[0] = [*command[k], nan, 1.0]
        fleet.advance(max(int(ticks[k]), 0))
    return vel, true_vel, pos, true_pos


@pytest.mark.parametrize(
    ("name", "lean_deg", "limit_mps"),
    [
        ("arducopter_quad18_default.csv.gz", 30.0, 0.25),
        ("arducopter_quad18_lean45_accel250.csv.gz", 45.0, 0.15),
    ],
)
def test_velocity_and_place_follow_the_log(name: str, lean_deg: float, limit_mps: float) -> None:
    vel, true_vel, pos, true_pos = replay(name, lean_deg)
    rms = float(np.sqrt(((vel - true_vel) ** 2).sum(axis=1).mean()))
    flown_m = float(np.linalg.norm(np.diff(true_pos, axis=0), axis=1).sum())
    off_m = float(np.linalg.norm(pos - true_pos, axis=1).max())
    assert rms <= limit_mps
    assert off_m <= 0.03 * flown_m
    assert off_m <= 10.0  # what it is in fact, on 4 km
