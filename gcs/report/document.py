"""The report as JSON: the contract's result object, with the curves, events and provenance beside it."""

from dataclasses import asdict
from typing import Any

from gcs.ports import Event
from gcs.report.data import ReportData
from gcs.report.series import decision_percentiles_ms, series, uav_totals, user_totals


def report_document(data: ReportData) -> dict[str, Any]:
    """JSON-able facts of the campaign."""
    return result_object(data) | {
        "state": data.state,
        "reason": data.reason,
        "comparison": [
            {"label": row.label, "note": row.note, **asdict(row.metrics), "final_aoi": row.final_aoi}
            for row in data.comparison
        ],
        "series": {name: list(values) for name, values in asdict(series(data)).items()},
        "uav_totals": [asdict(row) for row in uav_totals(data)],
        "user_totals": [asdict(row) for row in user_totals(data)],
        "events": [_event(event) for event in data.events],
        "provenance": asdict(data.provenance),
    }


def result_object(data: ReportData) -> dict[str, Any]:
    """The contract's result object for one flight; metrics are null when no slot was finished."""
    names = ("episodic_aoi", "data_collection_ratio", "user_coverage", "energy_ratio", "final_aoi")
    metrics = asdict(data.metrics) if data.metrics else dict.fromkeys(names)
    decision = decision_percentiles_ms([record.decision_ms for record in data.flown])
    return {
        "mission": data.name,
        "policy": data.policy,
        "uavs": data.scenario.num_uavs,
        "mcl_db": data.scenario.radio.mcl_db,
        "slots": data.records[-1].slot,
        "seeds": [] if data.provenance.seed is None else [data.provenance.seed],
        **metrics,
        "decision_ms": dict(zip(("p50", "p99"), decision, strict=True)) if decision else None,
        "violations": dict(data.violations),
    }


def _event(event: Event) -> dict[str, Any]:
    return {
        "time_s": event.time_s,
        "kind": event.kind,
        "severity": event.severity.value,
        "message": event.message,
        "system_id": event.system_id,
        "actor": event.actor,
        "data": dict(event.data),
    }
