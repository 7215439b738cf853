"""Writes a run's results: ``README.md`` with all tables, CSV files, plots."""

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from policy.evaluation.files import write_text
from policy.evaluation.tables import markdown, network_plots, plots
from policy.evaluation.tables.campuses import Campus
from policy.evaluation.tables.grid import Grid
from policy.evaluation.tables.load import flat_row
from policy.evaluation.tables.methods import Absent, Method, Row
from policy.evaluation.tables.paper import FIGURES
from policy.evaluation.tables.provenance import Provenance
from policy.evaluation.tables.sweep import Cells

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = "README.md"
DRAWN: Mapping[str, int | None] = {"uavs": None, "mcl": None, "trajectories": 3, "relations": 2, "curves": None}
"""Sections with pictures, and the paper's figure where it is the same for every campus."""


@dataclass(frozen=True)
class Findings:
    """All that is to be shown."""

    grid: Grid
    campuses: Sequence[Campus]
    absent: Mapping[str, Absent]  # campuses whose traces are not at hand
    cells: Cells
    timings: Mapping[str, Mapping[str, Any]]  # by campus
    provenance: Provenance
    quick: bool
    relations: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # by campus, see ``relations.py``
    lacking: int = 0  # campaigns that were not flown


def write_report(out: Path, found: Findings) -> list[Path]:
    """Write everything into ``out``, the page last, and say what. Raises OutputError."""
    drawn = _draw(out, found) if plots.can_plot() else set()
    written = [out / f"{name}.{kind}" for name in sorted(drawn) for kind in ("svg", "png")]
    tables = {"campaigns.csv": _campaign_rows(found.cells), "timing.csv": _timing_rows(found.timings)}
    for name, rows in tables.items():
        if rows:
            write_text(out / name, csv_text(rows))
            written.append(out / name)
    write_text(out / PAGE, page(found, drawn))
    return [*written, out / PAGE]


def page(found: Findings, drawn: Iterable[str] = ()) -> str:
    """The Markdown page; ``drawn`` names the plots beside it."""
    blocks = ["# Tables and figures, measured", *_head(found)]
    for section in found.grid.sections:
        blocks += [*_tables(section, found), *_pictures(section, found, set(drawn))]
    return "\n\n".join(blocks) + "\n"


def csv_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """With a header line."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return buffer.getvalue()


def _head(found: Findings) -> Iterator[str]:
    extent = found.grid.extent
    seeds = f"0 to {extent.seeds - 1}" if extent.seeds > 1 else "0"
    starts = "Seed 0 starts at the launch point, the others within 50 m of it"
    items = [
        *found.provenance.lines(),
        f"- Seeds: {seeds}. {starts}; ± is the standard deviation over these seeds (divided by their number).",
        *(f"- {campus.name}: {campus.slots} slots" for campus in found.campuses),
        *(f"- {name}: not flown, {absent.reason}" for name, absent in found.absent.items()),
        *_networks(found.grid),
    ]
    if found.lacking:
        items.append(f"- **{found.lacking} campaigns were not flown**: figures stand on the rest, without ± on one")
    yield "Written by `python -m policy tables`; `docs/tables.md` says how to read and repeat it."
    yield "\n".join(items)
    if found.quick:
        yield "**A quick run: campaigns are cut short, so its figures cannot be set against the paper's.**"


def _networks(grid: Grid) -> Iterator[str]:
    rows = [*grid.methods, *grid.ablations, *grid.tree_ablations, *grid.next_states]
    methods = dict.fromkeys(_single(rows)) | dict.fromkeys(line.method for line in grid.similarities)
    known = {m.checkpoint_sha256: m for m in methods if not isinstance(m, Absent) and m.checkpoint_sha256}
    for digest, method in known.items():
        name = Path(method.checkpoint).name if method.checkpoint else "the shipped default"
        yield f"- Network of `{method.policy}` ({method.network}): {name}, SHA-256 {digest}"


def _single(rows: Iterable[Row]) -> Iterator[Method | Absent]:
    """Every network by itself."""
    for method in (method for row in rows for method in row.all_methods):
        yield from method.by_seed if isinstance(method, Method) and method.by_seed else (method,)


def _tables(section: str, found: Findings) -> Iterator[str]:
    grid, cells = found.grid, found.cells
    if section == "table1":
        yield from markdown.table_i(grid, cells)
    elif section == "table2":
        yield from markdown.table_ii(grid, found.timings)
    elif section == "table3":
        yield from markdown.table_iii(grid, cells)
    elif section == "nextstate":
        yield from markdown.next_states(grid, cells)
    elif section == "methods":
        yield from markdown.methods_table(grid, cells)
    elif section in ("uavs", "mcl"):
        yield from markdown.figures(section, grid, cells)
    elif section == "relations":
        yield from markdown.relation_weights(grid)
    elif section == "curves":
        yield from markdown.learning_curves(grid)
    else:
        yield "## Trajectories (Fig. 3)"
        yield "Seed 0; grey dots are the users' places over the whole campaign."


def _pictures(section: str, found: Findings, drawn: set[str]) -> Iterator[str]:
    if section not in DRAWN:
        return
    if section in drawn:
        yield markdown.picture(section, section)
    for campus in found.campuses:
        name = f"{section}-{campus.name}"
        if name in drawn:
            number = DRAWN[section] or FIGURES.get((section, campus.name))
            yield markdown.picture(name, f"{campus.name}, as Fig. {number}" if number else campus.name)
    if not drawn and not plots.can_plot():
        yield "No plots: matplotlib is not installed (`pip install 'uav-crowdsensing[train]'`)."


def _draw(out: Path, found: Findings) -> set[str]:
    drawn = set()
    for section in found.grid.sections:
        for name, figure in _figures(section, found):
            if figure is not None:
                plots.save(figure, out, name)
                drawn.add(name)
    return drawn


def _figures(section: str, found: Findings) -> "Iterator[tuple[str, Figure | None]]":
    """A section's pictures by name; None where there is nothing to be drawn."""
    if section == "curves":
        yield section, network_plots.learning_curves(found.grid.networks)
    for campus in found.campuses:
        name = f"{section}-{campus.name}"
        if section in ("uavs", "mcl"):
            yield name, plots.curves(section, campus.name, found.grid, found.cells)
        elif section == "trajectories":
            yield name, plots.trajectories(campus, found.grid, found.cells)
        elif section == "relations" and campus.name in found.relations:
            yield name, network_plots.relation_lines(campus, found.relations[campus.name])


def _campaign_rows(cells: Cells) -> list[dict[str, Any]]:
    return [flat_row(cell) for of_point in cells.values() for cell in of_point]


def _timing_rows(timings: Mapping[str, Mapping[str, Any]]) -> list[dict[str, Any]]:
    return [
        {"campus": campus, "method": name, **{f"{key}_ms": value for key, value in spent_ms.items()}}
        for campus, timing in timings.items()
        for name, spent_ms in timing["methods"].items()
    ]
