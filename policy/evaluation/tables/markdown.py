"""The tables as Markdown, the paper's figures beside ours. Text in, text out: the same results give the same bytes."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from policy.evaluation.learning_curve import CurvePoint
from policy.evaluation.tables.cells import Point
from policy.evaluation.tables.grid import BASE_MCL_DB, BASE_UAVS, PAPER_DEPTH, Grid, axis
from policy.evaluation.tables.methods import Absent, Method, Row
from policy.evaluation.tables.paper import FIGURES, TABLE_I, TABLE_II_MS, TABLE_III, Printed
from policy.evaluation.tables.spread import METRICS, spread
from policy.evaluation.tables.sweep import Cells

NOT_PRINTED = "–"
MISSING = "missing"
"""What cannot be flown here; the reason stands above the table."""
PAIRS = tuple(f"{sign} {whose}" for sign in METRICS.values() for whose in ("paper", "ours"))


def table_i(grid: Grid, cells: Cells) -> Iterator[str]:
    """Similarity functions by depth N."""
    yield "## Table I: similarity functions and depth"
    yield "The paper's own search: nine actions, depth N, learned next states and value (Eq. 12-14)."
    yield from _reasons((line.similarity, line.method) for line in grid.similarities)
    for campus in grid.campuses:
        lines = (
            [line.similarity, str(line.depth), *_pairs(campus, line.method, cells, printed)]
            for line in grid.similarities
            for printed in [TABLE_I.get((line.similarity, line.depth, campus))]
        )
        yield from _titled_table(campus, ["similarity", "N", *PAIRS], lines)


def table_ii(grid: Grid, timings: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """Milliseconds of a decision."""
    yield "## Table II: time of a decision (ms)"
    yield (
        f"One thread, U = {BASE_UAVS}, all methods taking turns slot by slot in one run; all that a decision needs, by "
        "the clock. Where processor time is much less, other programs held the processor. The paper's figures are from "
        "112 cores."
    )
    yield from _missing(grid, grid.methods)
    for campus in grid.campuses:
        measured = timings.get(campus, {}).get("methods", {})
        lines = ([row.name, *_timing(row, campus, measured)] for row in grid.methods)
        yield from _titled_table(campus, ["method", "paper", "median", "mean", "p99", "processor, median"], lines)


def table_iii(grid: Grid, cells: Cells) -> Iterator[str]:
    """Ablations."""
    yield "## Table III: ablations"
    yield (
        "Ours: the default `gcrl` less one part or two. Without prediction its search takes users to stay; "
        "without RGCN its network was trained without it. The plain planner has neither network nor prediction."
    )
    yield from _compared(grid, grid.ablations, cells)
    yield f"## Table III with the paper's own search, N = {PAPER_DEPTH}"
    yield (
        "Nine actions, learned value (Eq. 13-14). Without prediction it searches the world's own physics with users "
        "that stay; without RGCN its network was trained without it."
    )
    yield from _compared(grid, grid.tree_ablations, cells)


def next_states(grid: Grid, cells: Cells) -> Iterator[str]:
    """Where the search takes its next states from (Eq. 12)."""
    yield "## Next state: exact, hybrid, learned, printed"
    yield (
        f"The paper's own search (nine actions, N = {PAPER_DEPTH}, learned value) on four kinds of next states: "
        "`exact`, the world's own physics with users that stay; `hybrid`, the same with users where the network "
        "predicts them; `learned`, UAVs, energy and users by the network, data and AoI by Def. 1 and 2 from there; "
        "`printed`, data and AoI by the network too, which is not told the action there (Eq. 12). The reward is Eq. 8 "
        "by Def. 1 and 2 in all."
    )
    yield from _missing(grid, grid.next_states)
    at = (BASE_UAVS, BASE_MCL_DB)
    lines = (
        [sign, row.name, *(_ours(campus, row.on(campus), cells, metric, at) for campus in grid.campuses)]
        for metric, sign in METRICS.items()
        for row in grid.next_states
    )
    yield _table(["", "next state", *grid.campuses], lines)


def methods_table(grid: Grid, cells: Cells) -> Iterator[str]:
    """Everyone at the paper's main setting."""
    yield f"## All methods, U = {BASE_UAVS}, {BASE_MCL_DB:g} dB"
    yield "The paper prints numbers of its own method only; those of its baselines are curves (Figures 4 to 9)."
    yield from _compared(grid, grid.methods, cells)


def figures(section: str, grid: Grid, cells: Cells) -> Iterator[str]:
    """The data behind Figures 4, 6, 8 (``uavs``) or 5, 7, 9 (``mcl``)."""
    what = f"number of UAVs, {BASE_MCL_DB:g} dB" if section == "uavs" else f"MCL, U = {BASE_UAVS}"
    yield f"## Figures: {what}"
    yield from _missing(grid, grid.methods)
    points = axis(section, grid.extent)
    heads = [f"U = {uavs}" if section == "uavs" else f"{mcl_db:g} dB" for uavs, mcl_db in points]
    for campus in grid.campuses:
        figure = FIGURES.get((section, campus))
        title = f"{campus} (Fig. {figure})" if figure else campus
        lines = (
            [sign, row.name, *(_ours(campus, row.on(campus), cells, metric, at) for at in points)]
            for metric, sign in METRICS.items()
            for row in grid.methods
        )
        yield from _titled_table(title, ["", "method", *heads], lines)


def relation_weights(grid: Grid) -> Iterator[str]:
    """Text above the pictures of Fig. 2."""
    yield "## Relation weights (Fig. 2)"
    yield (
        "How much each UAV attends to each user (Eq. 11d), in the middle of the campaign that the default `gcrl` flies "
        "from the launch point. A line is as thick as its weight, each picture by its own greatest; the darker a user, "
        "the older its data."
    )
    yield from _reasons([("gcrl", grid.attending)])


def learning_curves(grid: Grid) -> Iterator[str]:
    """Text above the picture of learning curves, and each one's end."""
    yield "## Learning curves"
    yield (
        "From `curve.csv`, which training leaves beside its checkpoint. Dots are single episodes, each at another "
        "place; the line is the mean of the last 20, which is the column κ. Losses are means of the last 20. "
        "While a training warms up its network does not fly, so the scores of trainings on the same draws coincide; a "
        "score tells more of its place than of the network, the losses tell what was learned."
    )
    without = [f"`{model.name}`" for model in grid.networks if not model.curve]
    if without:
        yield f"Without a curve: {', '.join(without)} (`python -m policy.training.curve` makes one from `logs`)."
    kept = [(model, model.curve) for model in grid.networks if model.curve]
    lines = ([model.name, model.kind, str(curve[-1].episode), *_end(curve)] for model, curve in kept)
    if kept:
        yield _table(["network", "kind", "episodes", "κ", "L_val", "L_pred"], lines)


def _end(curve: Sequence[CurvePoint]) -> Iterator[str]:
    last = curve[-20:]
    yield f"{curve[-1].mean_score:.3f}"
    yield f"{sum(point.value_loss for point in last) / len(last):.4f}"
    yield f"{sum(point.prediction_loss for point in last) / len(last):.4f}"


def picture(name: str, title: str) -> str:
    """A plot; the same name with .png beside it."""
    return f"![{title}]({name}.svg)"


def _compared(grid: Grid, rows: Sequence[Row], cells: Cells) -> Iterator[str]:
    yield from _missing(grid, rows)
    for campus in grid.campuses:
        lines = ([row.name, *_pairs(campus, row.on(campus), cells, TABLE_III.get((row.name, campus)))] for row in rows)
        yield from _titled_table(campus, ["method", *PAIRS], lines)


def _missing(grid: Grid, rows: Sequence[Row]) -> Iterator[str]:
    """What cannot be flown on some campus, and why."""
    yield from _reasons((row.name, row.on(campus)) for row in rows for campus in grid.campuses)


def _reasons(rows: Iterable[tuple[str, Method | Absent]]) -> Iterator[str]:
    """One line for all that is missing, those with the same reason together."""
    by_reason: dict[str, dict[str, None]] = {}
    for name, method in rows:
        if isinstance(method, Absent):
            by_reason.setdefault(method.reason, {})[f"`{name}`"] = None
    if by_reason:
        yield "Missing: " + "; ".join(f"{', '.join(names)} ({reason})" for reason, names in by_reason.items()) + "."


def _pairs(campus: str, method: Method | Absent, cells: Cells, printed: Printed | None) -> Iterator[str]:
    """Paper's and ours for each metric."""
    for metric in METRICS:
        yield f"{getattr(printed, metric):.3f}" if printed else NOT_PRINTED
        yield _ours(campus, method, cells, metric, (BASE_UAVS, BASE_MCL_DB))


def _ours(campus: str, method: Method | Absent, cells: Cells, metric: str, at: tuple[int, float]) -> str:
    if isinstance(method, Absent):
        return MISSING
    value = spread(cells.get(Point(campus, method, *at), ()), metric)
    return str(value) if value else "failed"


def _timing(row: Row, campus: str, measured: Mapping[str, Mapping[str, float]]) -> Iterator[str]:
    printed = TABLE_II_MS.get((row.name, campus))
    yield f"{printed:.3f}" if printed else NOT_PRINTED
    for name in ("p50", "mean", "p99", "processor_p50"):
        if isinstance(row.on(campus), Absent):
            yield MISSING
        else:
            yield f"{measured[row.name][name]:.3f}" if row.name in measured else "failed"


def _titled_table(title: str, head: Sequence[str], lines: Iterable[Sequence[str]]) -> Iterator[str]:
    yield f"### {title}"
    yield _table(head, lines)


def _table(head: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    rows = [head, ["---"] * len(head), *lines]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)
