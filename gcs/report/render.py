"""Writes the report: ``index.html`` (one file, no network) and beside it the same campaign for programs.

``report.json`` has all numbers, ``trajectory.csv`` every UAV and user after every slot, ``tracks.geojson`` and
``tracks.kml`` the ways for map programs, ``mission.toml`` the mission to fly again.
"""

import json
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape
from markupsafe import Markup

from gcs.ports import Severity
from gcs.report.aoi_scale import AOI_STEPS
from gcs.report.charts import Curve, line_chart
from gcs.report.data import MetricsRow, ReportData
from gcs.report.document import report_document
from gcs.report.map_view import map_view
from gcs.report.repeat import mission_toml
from gcs.report.series import Series, decision_percentiles_ms, series, uav_totals, user_totals
from gcs.report.tracks import geojson, kml
from gcs.report.trajectory import trajectory_csv
from policy.world.metrics import Metrics

FILES_BESIDE = "beside this page: report.json, trajectory.csv, tracks.geojson, tracks.kml, mission.toml"
SHOWN_EVENTS = 400
"""The page stays readable; report.json has every event."""


@dataclass(frozen=True)
class MetricColumn:
    """How one of the four metrics is written. ``better`` is +1 when more is better, -1 when less is."""

    field: str
    symbol: str
    title: str
    explained: str
    better: int
    percent: bool

    def value(self, metrics: Metrics) -> float:
        """The metric's number."""
        return float(getattr(metrics, self.field))

    def text(self, metrics: Metrics) -> str:
        """The number as people read it."""
        value = self.value(metrics)
        return f"{100.0 * value:.1f}%" if self.percent else f"{value:.2f}"

    def change(self, ours: Metrics, other: MetricsRow) -> str:
        """How ours compares with another row, in words."""
        mine, theirs = self.value(ours), self.value(other.metrics)
        if abs(mine - theirs) < 0.005 * abs(theirs) or theirs == 0.0:
            return f"about as {other.label} ({self.text(other.metrics)})"
        amount = f"{100.0 * abs(mine / theirs - 1.0):.0f}% {'more' if mine > theirs else 'less'}"
        verdict = "better" if (mine - theirs) * self.better > 0 else "worse"
        return f"{verdict}: {amount} than {other.label} ({self.text(other.metrics)})"


METRIC_COLUMNS = (
    MetricColumn(
        "episodic_aoi", "κ", "Age of information", "mean over users and slots, in slots; 1 is best", -1, False
    ),
    MetricColumn("data_collection_ratio", "ψ", "Data collected", "of what the users produced", 1, True),
    MetricColumn("user_coverage", "ρ", "Users covered", "mean share of users served in a slot", 1, True),
    MetricColumn("energy_ratio", "ζ", "Energy used", "of a full battery, mean over UAVs", -1, True),
)


def render_report(data: ReportData, out_dir: Path) -> Path:
    """Write the files into ``out_dir`` (made if missing) and return the path of ``index.html``."""
    out_dir.mkdir(parents=True, exist_ok=True)
    texts = {
        "report.json": json.dumps(report_document(data), indent=2, allow_nan=False, default=str) + "\n",
        "trajectory.csv": trajectory_csv(data.records),
        "tracks.geojson": json.dumps(geojson(data), allow_nan=False) + "\n",
        "tracks.kml": kml(data),
        "mission.toml": mission_toml(data.provenance.mission),
        "index.html": render_page(data),
    }
    for name, text in texts.items():
        _replace(out_dir / name, text)
    return out_dir / "index.html"


def render_page(data: ReportData, other_forms: str = FILES_BESIDE) -> str:
    """The page's HTML; ``other_forms`` says where the same campaign is for programs."""
    curves = series(data)
    rows = _rows(data)
    return _environment().get_template("report.html.j2").render(
        data=data,
        map=map_view(data),
        aoi_steps=AOI_STEPS,
        columns=METRIC_COLUMNS,
        rows=rows,
        others=data.comparison if data.metrics else (),
        charts=_charts(curves),
        decision=decision_percentiles_ms(curves.decision_ms),
        uav_totals=uav_totals(data),
        user_totals=user_totals(data),
        events=sorted(data.events, key=lambda e: (-_rank(e.severity), e.time_s))[:SHOWN_EVENTS],
        shown_events=SHOWN_EVENTS,
        mission_toml=mission_toml(data.provenance.mission),
        other_forms=other_forms,
    )  # fmt: skip


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("gcs.report"),
        autoescape=select_autoescape(default=True),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["clock"] = clock_text
    return environment


def clock_text(seconds: float) -> str:
    """Seconds as h:mm:ss."""
    whole = round(seconds)
    return f"{whole // 3600}:{whole % 3600 // 60:02d}:{whole % 60:02d}"


def _rows(data: ReportData) -> list[MetricsRow]:
    own = [MetricsRow(f"{data.policy} (this flight)", data.metrics)] if data.metrics else []
    return own + list(data.comparison)


def _charts(curves: Series) -> list[tuple[str, Markup]]:
    slots = curves.slot
    return [
        (
            "Age of information, slots",
            line_chart(
                slots,
                [Curve("users' mean now", curves.mean_aoi_slots), Curve("κ so far", curves.aoi_so_far)],
                name="chart-aoi",
            ),
        ),
        (
            "Data collected",
            line_chart(slots, [Curve("ψ so far", curves.collected_so_far)], name="chart-data", percent=True, top=1.0),
        ),
        (
            "Users covered",
            line_chart(
                slots,
                [Curve("served in the slot", curves.served), Curve("ρ so far", curves.coverage_so_far)],
                name="chart-cover",
                percent=True,
                top=1.0,
            ),
        ),
        (
            "Energy used, of a full battery",
            line_chart(slots, [Curve("ζ so far", curves.energy_so_far)], name="chart-energy", percent=True, top=1.0),
        ),
    ]


def _rank(severity: Severity) -> int:
    return (Severity.INFO, Severity.CAUTION, Severity.WARNING).index(severity)


def _replace(path: Path, text: str) -> None:
    """Whole or not at all: a reader never sees half a file."""
    part = path.with_name(path.name + ".part")
    part.write_text(text, encoding="utf-8")
    part.replace(path)
