"""What a person sees: a progress bar on a terminal's stderr, a table on stdout."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from policy.evaluation.results import CampaignResult

LABELS = {
    "episodic_aoi": "episodic AoI κ (slots)",
    "data_collection_ratio": "data collection ratio ψ",
    "user_coverage": "user coverage ρ",
    "energy_ratio": "energy ratio ζ",
    "final_aoi": "final AoI (slots)",
}


@contextmanager
def progress_bar(title: str, total: int) -> Iterator[Callable[..., None]]:
    """Gives the function that moves the bar by one step, or by as many as it is told; silent without a terminal."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), disable=not sys.stderr.isatty()) as progress:
        task = progress.add_task(title, total=total)
        yield lambda steps=1: progress.advance(task, steps)


@contextmanager
def training_bar(title: str, total: int) -> Iterator[Callable[[int, float], None]]:
    """Gives the function that shows (episodes flown, mean score); with the time left; silent as above."""
    score = TextColumn("AoI {task.fields[score]}")
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), score, TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), disable=not sys.stderr.isatty()) as progress:
        task = progress.add_task(title, total=total, score="-")
        yield lambda flown, mean: progress.update(task, completed=flown, score=f"{mean:.2f}")


def print_result(result: CampaignResult) -> None:
    """The metrics of a result, one a line."""
    seeds = len(result.metrics)
    title = f"{result.mission}: {result.policy}, {result.uavs} UAVs, {result.mcl_db:g} dB, {result.slots} slots"
    table = Table(title=title if seeds == 1 else f"{title}, {seeds} seeds")
    table.add_column("metric")
    table.add_column("value" if seeds == 1 else "mean ± std", justify="right")
    for name, label in LABELS.items():
        spread = "" if seeds == 1 else f" ± {result.std(name):.3f}"
        table.add_row(label, f"{result.mean(name):.3f}{spread}")
    p50, p99 = result.decision_percentile(50.0), result.decision_percentile(99.0)
    if p50 is not None and p99 is not None:
        table.add_row("decision, median / p99 (ms)", f"{p50:.1f} / {p99:.1f}")
    broken = ", ".join(f"{name} {count}" for name, count in result.violations.items() if count)
    table.add_row("violations", broken or "none")
    Console().print(table)
