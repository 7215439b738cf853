"""``python -m policy.mobility``: synthetic crowds beside the real sets that they stand for."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import asdict
from statistics import fmean

from policy.mobility.presets import REAL_SETS, WALKER_PRESETS, RealSet
from policy.mobility.reader import find_trace, read_traces
from policy.mobility.statistics import MobilityStatistics, mobility_statistics
from policy.mobility.traces import TraceError
from policy.mobility.walkers import generate_walkers

NUM_SAMPLES = 121
SLOT_S = 15.0


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a Markdown table for each real set at hand; 2 where none is."""
    parser = argparse.ArgumentParser(prog="python -m policy.mobility", description=__doc__)
    parser.add_argument("--seeds", type=int, default=20, help="synthetic crowds that are averaged (default 20)")
    seeds = parser.parse_args(arguments).seeds
    if seeds < 1:
        parser.error("--seeds must be at least 1")
    try:
        tables = [comparison_table(real, seeds) for real in REAL_SETS]
    except TraceError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write("\n".join(tables))
    return 0


def comparison_table(real: RealSet, seeds: int) -> str:
    """Each figure of the real set, the mean of the synthetic crowds, and their range."""
    traces = read_traces(
        find_trace(real.file, None), area_size_m=real.area_size_m, num_samples=NUM_SAMPLES, slot_s=SLOT_S
    )
    measured = asdict(mobility_statistics(traces))
    crowds = [asdict(crowd) for crowd in synthetic_statistics(real, traces.num_users, seeds)]
    lines = [f"| {traces.num_users} users | {real.file} | {real.preset} | lowest | highest |", "| --- " * 5 + "|"]
    for name, value in measured.items():
        values = [crowd[name] for crowd in crowds]
        lines.append(f"| {name} | {value:.2f} | {fmean(values):.2f} | {min(values):.2f} | {max(values):.2f} |")
    return "\n".join(lines) + "\n"


def synthetic_statistics(real: RealSet, num_users: int, seeds: int) -> list[MobilityStatistics]:
    """One crowd a seed, as many users on as large an area as in ``real``."""
    params = WALKER_PRESETS[real.preset]
    return [
        mobility_statistics(generate_walkers(num_users, NUM_SAMPLES, SLOT_S, real.area_size_m, seed, params=params))
        for seed in range(seeds)
    ]


if __name__ == "__main__":
    sys.exit(main())
