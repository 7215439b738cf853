"""Real ArduCopter logs, flown again by the motion model from the same commands."""

from __future__ import annotations

import csv
import gzip
import os
from dataclasses import dataclass, replace
from functools import cache
from math import nan, radians
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sitl_mock.physics.fleet import TICK_S, Fleet
from sitl_mock.physics.vehicle import ARDUQUAD, VehicleType

LOGS = Path(os.environ.get("UCS_FLIGHT_DIR", Path(__file__).parents[2].parent / "shared" / "data" / "flight"))
GUID_TIMEOUT_S = 3.0
DEFAULT, LEAN_45 = "arducopter_quad18_default.csv.gz", "arducopter_quad18_lean45_accel250.csv.gz"
LEAN_DEG = {DEFAULT: 30.0, LEAN_45: 45.0}  # ANGLE_MAX, the one parameter in which the two flights differ for us
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Log:
    """What was commanded and flown: time [T], velocities and positions [T, 3] NED."""

    time_s: Array
    command_mps: Array
    velocity_mps: Array
    position_m: Array


@dataclass(frozen=True)
class Judgement:
    """How far the model is from the log."""

    rms_mps: float
    worst_mps: float
    off_m: float
    flown_m: float


@cache
def read(name: str) -> Log:
    """The flight from the first hover to the return, setpoints zero once GUID_TIMEOUT has passed without any."""
    with gzip.open(LOGS / name, "rt", newline="") as file:
        rows = list(csv.DictReader(file))
    start = next(i for i, row in enumerate(rows) if row["phase"] == "hover")
    stop = next(i for i, row in enumerate(rows) if row["phase"] == "rtl")
    rows = rows[start:stop]

    def columns(*names: str) -> Array:
        return np.array([[float(row[name]) for name in names] for row in rows])

    time_s = columns("t_boot_s")[:, 0]
    command = columns("cmd_vn", "cmd_ve", "cmd_vd")
    lost = np.array([row["phase"] == "no_setpoints" for row in rows])
    command[lost & (time_s >= time_s[lost][0] + GUID_TIMEOUT_S)] = 0.0
    return Log(time_s, command, columns("true_vn", "true_ve", "true_vd"), columns("x_n", "y_e", "z_d"))


def fly(name: str, kind: VehicleType = ARDUQUAD) -> tuple[Array, Array]:
    """The model's velocities and positions [T, 3] under the log's commands."""
    log = read(name)
    fleet = Fleet([replace(kind, max_lean_rad=radians(LEAN_DEG[name]))])
    fleet.place(log.position_m[:1], np.zeros((1, 3)))
    ticks = np.diff(np.round((log.time_s - log.time_s[0]) / TICK_S).astype(int), append=0)
    velocity, position = np.empty_like(log.velocity_mps), np.empty_like(log.position_m)
    for k, command in enumerate(log.command_mps):
        velocity[k], position[k] = fleet.vel_ned_mps[0], fleet.pos_ned_m[0]
        fleet.command[0] = [*command, nan, 1.0]
        fleet.advance(max(int(ticks[k]), 0))
    return velocity, position


def judge(name: str, kind: VehicleType = ARDUQUAD) -> Judgement:
    """The model against the log."""
    log = read(name)
    velocity, position = fly(name, kind)
    error = velocity - log.velocity_mps
    return Judgement(
        rms_mps=float(np.sqrt((error**2).sum(axis=1).mean())),
        worst_mps=float(np.abs(error).max()),
        off_m=float(np.linalg.norm(position - log.position_m, axis=1).max()),
        flown_m=float(np.linalg.norm(np.diff(log.position_m, axis=0), axis=1).sum()),
    )


def fitted(name: str) -> VehicleType:
    """The two fitted numbers found anew on one log: the attitude's lag and the vertical gain, by grid search."""
    kinds = [
        replace(ARDUQUAD, lean_frequency_radps=2.0 * ARDUQUAD.lean_damping / lag_s, vertical_gain_1ps=gain)
        for lag_s in (0.08, 0.12, 0.16, 0.20, 0.26)
        for gain in (1.6, 2.2, 3.0)
    ]
    return min(kinds, key=lambda kind: judge(name, kind).rms_mps)
