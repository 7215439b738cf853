"""The server's report: rules broken, and what was foretold."""

from dataclasses import asdict

import httpx
import pytest
from api_server import SMALL, Server
from test_api_dry_runs import finished

from gcs.api.report_facts import foretold, violations_of
from gcs.forecast.dry_runs import DryRun
from gcs.ports import Event, Severity
from policy.world.metrics import Metrics

METRICS = Metrics(2.0, 0.9, 0.4, 0.1, 2.5)


def broken(**count: int) -> Event:
    return Event(1.0, "safety.violation", "broken", Severity.WARNING, data=count)


def test_violations_are_summed_and_kinds_without_any_are_named():
    events = [broken(geofence=2), broken(geofence=1, battery=3), Event(2.0, "other", "", data={"geofence": 9})]
    assert violations_of(events) == {"geofence": 3, "separation": 0, "obstacle": 0, "battery": 3}


def test_a_forecast_becomes_two_rows_and_none_becomes_none():
    forecast = {
        "policy": "gcrl",
        "metrics": asdict(METRICS),
        "baseline": {"policy": "random", "metrics": asdict(METRICS)},
        "max_speed_mps": 18.0,
        "max_accel_mps2": 4.275,
    }
    rows = foretold(DryRun("a", "n", "gcrl", 4, {}, forecast=forecast))
    assert [(row.label, row.metrics) for row in rows] == [("gcrl (dry run)", METRICS), ("random (dry run)", METRICS)]
    assert "18.0 m/s and 4.3 m/s²" in rows[0].note
    assert foretold(None) == foretold(DryRun("a", "n", "gcrl", 4, {})) == ()


@pytest.mark.parametrize("dry", [False, True])
def test_the_page_has_a_comparison_when_there_was_a_dry_run(
    keyed: Server, operator: httpx.Client, campaign_id: str, dry: bool
) -> None:
    if dry:
        finished(operator, operator.post("/api/v1/dry-runs", json=SMALL).json())
    operator.post(f"/api/v1/campaigns/{campaign_id}/start")
    event = broken(obstacle=2)
    keyed.store.journal.record(Event(1.0, event.kind, "broken", Severity.WARNING, campaign_id, data=event.data))
    for slot in range(2):
        keyed.store.journal.record_slot(campaign_id, keyed.control.end_slot(slot))
    assert keyed.store.journal.flush(10.0)
    page = operator.get(f"/api/v1/campaigns/{campaign_id}/report", params={"format": "html"}).text
    assert ("random (dry run)" in page) is dry
    assert 'Violations: obstacle</dt><dd class="abnormal">2</dd>' in page
