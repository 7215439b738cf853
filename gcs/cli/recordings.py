"""What ``gcs replay`` can open, brought into a store of its own so that no record is ever written to.

Three kinds of LOG: a store of ``gcs serve`` (SQLite file), the export of one campaign
(``GET /api/v1/campaigns/{id}/report?format=json``), and the report of a headless flight (the folder of ``gcs fly
--report``, or its ``report.json``, with ``trajectory.csv``, ``telemetry.json`` and ``decisions.json`` beside it).
"""

import csv
import json
import math
import sqlite3
from collections.abc import Iterable, Mapping
from contextlib import closing
from datetime import UTC, datetime
from itertools import groupby
from pathlib import Path
from typing import Any

from gcs.api.recordings import without_files
from gcs.cli.errors import UsageError
from gcs.cli.flight_results import TELEMETRY_FILE
from gcs.ports import CampaignState, Event, Severity, SlotRecord, TelemetrySample, UavSlot, UserSlot
from gcs.store.campaigns import new_campaign_id
from gcs.store.decision_documents import DECISIONS_FILE, recorded_decision
from gcs.store.importing import ForeignCampaign, import_campaign
from gcs.store.records import recorded_metrics
from gcs.store.store import using_store
from gcs.store.vehicle_rows import telemetry_samples
from policy.mission_file import MissionError, parse_mission
from policy.world.metrics import Metrics

SQLITE_MAGIC = b"SQLite format 3\x00"
KINDS = "a store file of `gcs serve`, a campaign's report?format=json, or a folder of `gcs fly --report`"
METRICS = {
    "episodic_aoi": "aoi_so_far",
    "data_collection_ratio": "collected_so_far",
    "user_coverage": "coverage_so_far",
    "energy_ratio": "energy_so_far",
    "final_aoi": "mean_aoi_slots",
}
"""Metrics after a slot -> curve of ``report.json`` that has them."""
UAV_COLUMNS = ("east_m", "north_m", "heading_deg", "speed_mps", "energy_j")
USER_COLUMNS = ("east_m", "north_m", "aoi", "data_mb")


def copy_recording(log: Path, folder: Path) -> str:
    """The URL of a store in ``folder`` that holds what ``log`` recorded. Raises UsageError with one line."""
    copy = folder / "replay.db"
    url = f"sqlite:///{copy.as_posix()}"
    try:
        report = log / "report.json" if log.is_dir() else log
        if _starts_as_sqlite(report):
            _copy_store(report, copy)
            return url
        campaign = _read(report)
    except OSError as error:
        raise UsageError(f"{log}: cannot be read: {error.strerror or error}; give {KINDS}") from None
    with using_store(url) as store:
        import_campaign(store.engine, campaign)
    return url


def _starts_as_sqlite(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(len(SQLITE_MAGIC)) == SQLITE_MAGIC


def _copy_store(source: Path, copy: Path) -> None:
    """A whole copy even while a server writes to it (SQLite's backup)."""
    try:
        with (
            closing(sqlite3.connect(f"{source.resolve().as_uri()}?mode=ro", uri=True)) as reading,
            closing(sqlite3.connect(copy)) as writing,
        ):
            reading.backup(writing)
    except sqlite3.Error as error:
        raise UsageError(f"{source}: is no store that can be read: {error}") from None


def _read(path: Path) -> ForeignCampaign:
    try:
        document = json.loads(path.read_text("utf-8"))
        if isinstance(document, dict) and "campaign" in document:
            return _exported(document)
        if isinstance(document, dict) and "provenance" in document:
            return _flown(document, path.with_name("trajectory.csv"))
    except MissionError as error:
        raise UsageError(f"{path}: {error}") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise UsageError(f"{path}: is no complete recording ({type(error).__name__}: {error}); give {KINDS}") from None
    raise UsageError(f"{path}: is none of the recordings that can be shown: give {KINDS}")


def _exported(document: Mapping[str, Any]) -> ForeignCampaign:
    """The report that the server writes as JSON."""
    told = document["campaign"]
    events = document["events"]
    begun = min((datetime.fromisoformat(one["recorded_at"]) for one in events), default=datetime.now(UTC))
    records = tuple(_slot(slot) for slot in document["slots"])
    kept = document.get("telemetry")  # an older version kept none
    telemetry = () if kept is None else telemetry_samples(kept)
    told_events = [_event(one, told["id"]) for one in events]
    decisions = _decisions(document.get("decisions", ()))
    return _campaign(told["document"], told, document, begun, records, told_events, telemetry, decisions)


def _slot(slot: Mapping[str, Any]) -> SlotRecord:
    return SlotRecord(
        slot=int(slot["slot"]),
        time_s=float(slot["time_s"]),
        uavs=tuple(UavSlot(**_with_nan(uav)) for uav in slot["uavs"]),
        users=tuple(UserSlot(**_with_nan(user)) for user in slot["users"]),
        metrics=recorded_metrics(slot["metrics"]),
        decision_ms=slot["decision_ms"],
    )


def _flown(document: Mapping[str, Any], trajectory: Path) -> ForeignCampaign:
    """The report of ``gcs fly``: facts in one file, places in the other."""
    if not trajectory.is_file():
        raise UsageError(f"{trajectory}: is missing; report.json has no places without it")
    mission, begun = document["provenance"]["mission"], document["provenance"]["begun_utc"]
    told = {"id": new_campaign_id(), "name": document["mission"], "policy": document["policy"]}
    events = [_event(one, told["id"]) for one in document["events"]]
    begun_at = datetime.fromisoformat(begun) if begun else datetime.now(UTC)
    slot_s = float(parse_mission(without_files(mission)).scenario.slot_s)
    records = tuple(_with_curves(trajectory, document["series"], slot_s, _first_slot_s(events)))
    return _campaign(mission, told, document, begun_at, records, events, *_beside(trajectory))


def _beside(trajectory: Path) -> tuple[tuple[TelemetrySample, ...], tuple[Mapping[str, Any], ...]]:
    """Telemetry and decisions of a headless flight; nothing where an older version kept none."""
    telemetry, decisions = (trajectory.with_name(name) for name in (TELEMETRY_FILE, DECISIONS_FILE))
    return (
        telemetry_samples(json.loads(telemetry.read_text("utf-8"))) if telemetry.is_file() else (),
        _decisions(json.loads(decisions.read_text("utf-8"))) if decisions.is_file() else (),
    )


def _decisions(told: Iterable[Mapping[str, Any]]) -> tuple[Mapping[str, Any], ...]:
    """As they were written, once all of them can be read. Raises KeyError, TypeError, ValueError."""
    documents = tuple(told)
    for document in documents:
        recorded_decision(document)
    return documents


def _first_slot_s(events: Iterable[Event]) -> float:
    """When the slots began on the flight clock; a pause later on is not known here and shifts events."""
    states = (event for event in events if event.kind == "campaign.state")
    return min((event.time_s for event in states if event.data.get("state") == "flying"), default=0.0)


def _with_curves(trajectory: Path, curves: Mapping[str, Any], slot_s: float, begun_s: float) -> Iterable[SlotRecord]:
    index = {int(slot): i for i, slot in enumerate(curves["slot"])}
    with trajectory.open(encoding="utf-8", newline="") as file:
        for key, rows in groupby(csv.DictReader(file), key=lambda row: row["slot"]):
            slot, all_rows = int(key), list(rows)
            i = index.get(slot)
            yield SlotRecord(
                slot=slot,
                time_s=begun_s + slot * slot_s,
                uavs=tuple(_uav(row) for row in all_rows if row["kind"] == "uav"),
                users=tuple(_user(row) for row in all_rows if row["kind"] == "user"),
                metrics=None if i is None else Metrics(**{name: curves[of][i] for name, of in METRICS.items()}),
                decision_ms=None if i is None else curves["decision_ms"][i],
            )


def _uav(row: Mapping[str, str]) -> UavSlot:
    east_m, north_m, heading_deg, speed_mps, energy_j = (float(row[name]) for name in UAV_COLUMNS)
    return UavSlot(int(row["id"]), east_m, north_m, heading_deg, speed_mps, energy_j)


def _user(row: Mapping[str, str]) -> UserSlot:
    east_m, north_m, aoi, data_mb = (float(row[name]) for name in USER_COLUMNS)
    return UserSlot(row["id"], east_m, north_m, aoi, data_mb, row["served"] == "1")


def _campaign(
    mission: Mapping[str, Any],
    told: Mapping[str, Any],
    document: Mapping[str, Any],
    begun_at: datetime,
    records: tuple[SlotRecord, ...],
    events: Iterable[Event],
    telemetry: tuple[TelemetrySample, ...],
    decisions: tuple[Mapping[str, Any], ...],
) -> ForeignCampaign:
    scenario = parse_mission(without_files(mission)).scenario
    return ForeignCampaign(
        id=str(told["id"]),
        name=str(told["name"]),
        policy=str(told["policy"]),
        user_source=str(mission["users"]["source"]),
        state=CampaignState(document["state"]),
        reason=str(document["reason"]),
        document=mission,
        slots=scenario.slots,
        slot_s=scenario.slot_s,
        begun_at=begun_at if begun_at.tzinfo else begun_at.replace(tzinfo=UTC),
        records=records,
        events=tuple(events),
        telemetry=telemetry,
        decisions=decisions,
    )


def _event(told: Mapping[str, Any], campaign_id: str) -> Event:
    return Event(
        time_s=float(told["time_s"]),
        kind=str(told["kind"]),
        message=str(told["message"]),
        severity=Severity(told["severity"]),
        campaign_id=campaign_id,
        system_id=told["system_id"],
        actor=str(told["actor"]),
        data=dict(told["data"]),
    )


def _with_nan(values: Mapping[str, Any]) -> dict[str, Any]:
    """JSON has no NaN: a number that was none was written as null."""
    return {name: math.nan if value is None else value for name, value in values.items()}
