"""How a crowd moves, in figures that can be compared between real and synthetic users."""

import math
from dataclasses import dataclass

import numpy as np

from policy.mobility.traces import UserTraces
from policy.world.arrays import BoolArray, FloatArray
from policy.world.arrays import norm as length

CELL_M = 100.0
"""Side of the squares in which hot spots are counted: a building with its forecourt."""
TOP_CELLS = 5


@dataclass(frozen=True)
class MobilityStatistics:
    """Of one set of users. Steps and pauses are taken between fixes, see :func:`fix_interval_samples`."""

    standing_share: float  # of slots without any motion in the record
    fix_interval_s: float
    fix_standing_share: float  # of steps between fixes without motion
    step_median_m: float  # of steps with motion
    step_p90_m: float
    step_p99_m: float
    pause_mean_s: float
    pause_p90_s: float
    gyration_median_m: float  # radius of gyration over users
    gyration_p90_m: float
    top_cells_share: float  # of user-samples in the five most visited 100 m squares
    effective_cells: float  # exp(entropy) of the visits over squares
    spread_m: float  # standard deviation of all places about their mean


def mobility_statistics(traces: UserTraces) -> MobilityStatistics:
    """All figures of ``traces``; quantities of steps and pauses are 0 where nobody moves or pauses."""
    pos_m = traces.pos_enu_m
    interval, phase = fix_interval_samples(pos_m)
    step_m = length(np.diff(pos_m[phase::interval], axis=0))
    moving_m = step_m[step_m > 0.0]
    pause_s = interval * traces.slot_s * _run_lengths(step_m == 0.0)
    gyration_m = np.sqrt(np.mean(np.sum((pos_m - pos_m.mean(axis=0)) ** 2, axis=-1), axis=0))
    visits = _cell_shares(pos_m)
    return MobilityStatistics(
        standing_share=_mean(length(np.diff(pos_m, axis=0)) == 0.0),
        fix_interval_s=interval * traces.slot_s,
        fix_standing_share=_mean(step_m == 0.0),
        step_median_m=_quantile(moving_m, 0.5),
        step_p90_m=_quantile(moving_m, 0.9),
        step_p99_m=_quantile(moving_m, 0.99),
        pause_mean_s=_mean(pause_s),
        pause_p90_s=_quantile(pause_s, 0.9),
        gyration_median_m=_quantile(gyration_m, 0.5),
        gyration_p90_m=_quantile(gyration_m, 0.9),
        top_cells_share=float(np.sort(visits)[::-1][:TOP_CELLS].sum()),
        effective_cells=math.exp(-float(np.sum(visits * np.log(visits)))),
        spread_m=float(np.sqrt(np.sum(pos_m.reshape(-1, 2).var(axis=0)))),
    )


def fix_interval_samples(pos_m: FloatArray) -> tuple[int, int]:
    """Samples from one fix to the next, and the first fix: places [N, M, 2] change only at fixes.

    A receiver that fixes every 30 s, written in rows of 15 s, shows no motion in every second row: taken for
    standing, that would hide how much people move. The interval is the greatest one that explains all changes.
    """
    changed = 1 + np.flatnonzero(np.any(np.diff(pos_m, axis=0) != 0.0, axis=(1, 2)))
    interval = int(np.gcd.reduce(np.diff(changed))) if changed.size > 1 else 1
    return interval, int(changed[0]) % interval if changed.size else 0


def _run_lengths(holds: BoolArray) -> FloatArray:
    """Lengths of the runs of True along the first axis of [N, M], all users together: [R]."""
    edge = np.zeros((1, holds.shape[1]), dtype=np.int8)
    change = np.diff(np.concatenate([edge, holds.astype(np.int8), edge]), axis=0).T
    starts, ends = np.argwhere(change == 1)[:, 1], np.argwhere(change == -1)[:, 1]
    return (ends - starts).astype(np.float64)


def _cell_shares(pos_m: FloatArray) -> FloatArray:
    """Share of user-samples in each visited square: [C], sums to 1."""
    cells = np.floor(pos_m.reshape(-1, 2) / CELL_M).astype(np.int64)
    _, counts = np.unique(cells, axis=0, return_counts=True)
    return np.asarray(counts / counts.sum())


def _mean(values: FloatArray | BoolArray) -> float:
    return float(np.mean(values)) if values.size else 0.0


def _quantile(values: FloatArray, share: float) -> float:
    return float(np.quantile(values, share)) if values.size else 0.0
