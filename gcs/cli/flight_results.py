"""What a headless flight leaves behind: result object, trajectory, report and the table beside Random."""

import json
import shlex
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from gcs.ports import CampaignState, DecisionRecord, Event, SlotRecord, TelemetrySample
from gcs.report import MetricsRow, ReportData, render_report
from gcs.report.repeat import provenance
from gcs.store.decision_documents import DECISIONS_FILE, decisions_document
from gcs.store.vehicle_rows import telemetry_document, vehicle_rows
from policy.agents.registry import PolicyChoice
from policy.cli.display import LABELS
from policy.evaluation.evaluate import evaluate
from policy.evaluation.results import CampaignResult
from policy.evaluation.trajectory import UavRow, UserRow
from policy.mission_file import Mission
from policy.world.metrics import Metrics
from policy.world.scenario import Scenario

TELEMETRY_FILE = "telemetry.json"  # for `gcs replay`: what the vehicles said about once a second


@dataclass(frozen=True)
class FlownCampaign:
    """A campaign after its last drone has landed."""

    mission: Mission
    policy: PolicyChoice
    scenario: Scenario
    seed: int
    state: CampaignState
    reason: str
    records: tuple[SlotRecord, ...]
    events: tuple[Event, ...]
    violations: dict[str, int]
    wall_s: float
    begun_utc: str
    telemetry: tuple[TelemetrySample, ...] = ()
    decisions: tuple[DecisionRecord, ...] = ()
    repeat: str = ""  # one line that flies the mission again, in the report's folder

    @property
    def metrics(self) -> Metrics | None:
        """None when no slot was flown."""
        return self.records[-1].metrics if self.records else None

    def result(self, metrics: Metrics) -> CampaignResult:
        """The object of ``--json``."""
        return CampaignResult(
            mission=self.mission.name,
            policy=self.policy.name,
            uavs=self.scenario.num_uavs,
            mcl_db=self.scenario.radio.mcl_db,
            slots=self.scenario.slots,
            metrics=(metrics,),
            decision_ms=tuple(r.decision_ms for r in self.records if r.decision_ms is not None),
            violations=self.violations,
        )


def trajectory_rows(records: Sequence[SlotRecord]) -> Iterator[UavRow | UserRow]:
    """Rows of the trajectory file, in its order."""
    for record in records:
        for uav in record.uavs:
            place = (uav.east_m, uav.north_m)
            yield UavRow(record.slot, str(uav.system_id), *place, uav.heading_deg, uav.speed_mps, uav.energy_j)
        for user in record.users:
            fresh = (user.aoi_slots, user.data_mb, user.served)
            yield UserRow(record.slot, user.user_id, user.east_m, user.north_m, *fresh)


def random_beside(flown: FlownCampaign) -> Metrics:
    """The Random policy on the same mission, in the world model."""
    return evaluate(flown.mission, PolicyChoice("random")).result.metrics[0]


def print_table(flown: FlownCampaign, metrics: Metrics, random: Metrics, console: Console) -> None:
    """The four metrics, flown, beside Random's."""
    title = (
        f"{flown.mission.name}: {flown.policy.name}, {flown.scenario.num_uavs} drones, {flown.records[-1].slot} slots"
    )
    table = Table(title=f"{title}, {flown.wall_s:.0f} s")
    table.add_column("metric")
    table.add_column("flown", justify="right")
    table.add_column("random", justify="right")
    for name, label in LABELS.items():
        table.add_row(label, f"{getattr(metrics, name):.3f}", f"{getattr(random, name):.3f}")
    broken = ", ".join(f"{name} {count}" for name, count in flown.violations.items() if count)
    table.add_row("violations", broken or "none", "")
    console.print(table)


def write_report(flown: FlownCampaign, comparison: tuple[MetricsRow, ...], folder: Path) -> Path:
    """The report's folder; returns the page."""
    data = ReportData(
        name=flown.mission.name,
        policy=flown.policy.name,
        scenario=flown.scenario,
        records=flown.records,
        comparison=comparison,
        events=flown.events,
        violations=flown.violations,
        provenance=provenance(
            flown.mission,
            policy=flown.policy.name,
            checkpoint=flown.policy.checkpoint,
            repeat=flown.repeat,
            command=shlex.join(["python", "-m", "gcs", *sys.argv[1:]]),
            seed=flown.seed,
            begun_utc=flown.begun_utc,
            wall_s=flown.wall_s,
        ),
        state=str(flown.state),
        reason=flown.reason,
    )
    page = render_report(data, folder)
    kept = telemetry_document((sample.time_s, vehicle_rows(sample.vehicles)) for sample in flown.telemetry)
    for name, told in ((TELEMETRY_FILE, kept), (DECISIONS_FILE, decisions_document(flown.decisions))):
        (folder / name).write_text(json.dumps(told, separators=(",", ":"), allow_nan=False), "utf-8")
    return page
