"""Figures 3 to 9 as SVG and PNG. matplotlib comes with the ``train`` extra; without it there are tables only."""

import importlib.util
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from policy.evaluation.files import OutputError, write_text
from policy.evaluation.tables.campuses import Campus
from policy.evaluation.tables.cells import Point
from policy.evaluation.tables.grid import BASE_MCL_DB, BASE_UAVS, Grid, axis
from policy.evaluation.tables.methods import Method
from policy.evaluation.tables.spread import METRICS, spread
from policy.evaluation.tables.sweep import Cells
from policy.model.files import write_atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLE: Any = {"svg.hashsalt": "uav-crowdsensing", "svg.fonttype": "none", "font.size": 9.0}
"""The salt makes SVG identifiers, and so the files, the same each time."""
LABELS = {
    "episodic_aoi": "episodic AoI κ (slots)",
    "data_collection_ratio": "data collection ratio ψ",
    "user_coverage": "user coverage ρ",
    "energy_ratio": "energy ratio ζ",
}
RATIOS = frozenset({"episodic_aoi"})
"""Metrics of which methods differ by a factor: on an even axis ``random`` would press all others together."""
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c8c8c")
"""Told apart by colour-blind people too: Okabe and Ito, Color Universal Design, 2008, and a grey for their yellow."""
MARKS = "os^Dv<>P"


def can_plot() -> bool:
    """Whether matplotlib is installed."""
    return importlib.util.find_spec("matplotlib") is not None


def curves(section: str, campus: str, grid: Grid, cells: Cells) -> "Figure":
    """Four metrics along U or MCL, one line a method, bars for the deviation over seeds."""
    figure, panels = blank((9.0, 6.5), 2, 2)
    points = axis(section, grid.extent)
    along = [uavs if section == "uavs" else mcl_db for uavs, mcl_db in points]
    for panel, metric in zip(panels, METRICS, strict=True):
        for number, row in enumerate(grid.methods):
            if isinstance(method := row.on(campus), Method):
                series = [spread(cells.get(Point(campus, method, *at), ()), metric) for at in points]
                _line(panel, along, series, label=row.name, **_style(number))
        panel.set_xlabel("UAVs" if section == "uavs" else "MCL (dB)")
        panel.set_ylabel(LABELS[metric])
        panel.set_xticks(along)
        if metric in RATIOS:
            _by_ratio(panel)
        panel.grid(alpha=0.3)
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    figure.suptitle(campus)
    return figure


def trajectories(campus: Campus, grid: Grid, cells: Cells) -> "Figure | None":
    """The ways of UAVs (lines) and users (dots) as in Fig. 3, one panel a method; None where none was flown."""
    flown = [
        (row.name, way) for row in grid.methods if (way := _way(campus.name, row.on(campus.name), cells)) is not None
    ]
    if not flown:
        return None
    figure, panels = blank((4.5 * len(flown), 4.2), 1, len(flown))
    scenario, users = campus.opened(BASE_UAVS, BASE_MCL_DB)
    east_m, north_m = scenario.area.size_m
    for panel, (name, way_m) in zip(panels, flown, strict=True):
        dots: Any = {"color": "#999999", "markersize": 3.0, "rasterized": True}  # as one picture: there are thousands
        panel.plot(*users.pos_enu_m.reshape(-1, 2).T, ".", **dots)
        for obstacle in scenario.blocking_obstacles:
            panel.fill(*np.asarray(obstacle.polygon_m).T, color="#bbbbbb")
        for uav in range(way_m.shape[1]):
            colour = COLOURS[uav % len(COLOURS)]
            panel.plot(way_m[:, uav, 0], way_m[:, uav, 1], color=colour, linewidth=1.0, label=f"UAV {uav + 1}")
        panel.set(xlim=(0.0, east_m), ylim=(0.0, north_m), aspect="equal", title=f"{campus.name}: {name}")
        panel.set(xlabel="east (m)", ylabel="north (m)")
        panel.legend()
    return figure


def save(figure: "Figure", out: Path, name: str) -> None:
    """``NAME.svg`` and ``NAME.png`` in ``out``. Raises OutputError."""
    from matplotlib import rc_context  # noqa: PLC0415 - an extra

    text, image = io.StringIO(), io.BytesIO()
    with rc_context(STYLE):
        figure.savefig(text, format="svg", dpi=110, metadata={"Date": None, "Creator": None})
        figure.savefig(image, format="png", dpi=110, metadata={"Software": None})
    lines = (line.rstrip() for line in text.getvalue().splitlines())
    write_text(out / f"{name}.svg", "\n".join(lines) + "\n")
    try:
        write_atomically(out / f"{name}.png", image.getvalue())
    except OSError as error:
        raise OutputError(f"{out / name}.png: cannot be written: {error.strerror or error}") from error


def blank(size_inches: tuple[float, float], rows: int, columns: int) -> "tuple[Figure, Sequence[Axes]]":
    """A figure of its own, without pyplot's global state."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - an extra

    figure = Figure(figsize=size_inches, layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False)
    return figure, list(panels.ravel())


def _style(number: int) -> dict[str, Any]:
    """Of a method's line. Every other one is dashed with hollow marks, so that one right below it still shows."""
    style: dict[str, Any] = {"color": COLOURS[number % len(COLOURS)], "marker": MARKS[number % len(MARKS)]}
    if number % 2:
        style |= {"linestyle": "--", "markerfacecolor": "none", "markersize": 6.5}
    return style


def _line(panel: "Axes", along: Sequence[float], series: Sequence[Any], **style: Any) -> None:
    there = [(x, value) for x, value in zip(along, series, strict=True) if value is not None]
    if there:
        x, values = zip(*there, strict=True)
        means, deviations = [value.mean for value in values], [value.std for value in values]
        panel.errorbar(x, means, yerr=deviations, **{"capsize": 2.0, "markersize": 4.0, "linewidth": 1.2} | style)


def _by_ratio(panel: "Axes") -> None:
    """A logarithmic axis with plain numbers on it."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator  # noqa: PLC0415 - an extra

    panel.set_yscale("log")
    panel.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    panel.yaxis.set_minor_locator(NullLocator())
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def _way(campus: str, method: object, cells: Cells) -> Any:
    """UAVs' places [T+1, U, 2] of seed 0."""
    if not isinstance(method, Method):
        return None
    of_point: Sequence[Mapping[str, Any]] = cells.get(Point(campus, method, BASE_UAVS, BASE_MCL_DB), ())
    kept = [cell["uav_paths_m"] for cell in of_point if cell["seed"] == 0]
    return np.asarray(kept[0]) if kept else None
