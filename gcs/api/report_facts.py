"""What the server's report says beside the curves: the forecast made before the flight, and broken rules. Pure."""

from collections.abc import Sequence

from gcs.forecast.dry_runs import DryRun
from gcs.ports import Event
from gcs.report import MetricsRow
from gcs.report.forecast_rows import forecast_rows
from policy.evaluation.results import VIOLATION_NAMES

VIOLATION = "safety.violation"


def violations_of(events: Sequence[Event]) -> dict[str, int]:
    """UAV-slots by kind, as the mission manager told them; all kinds, so that none is seen to be none."""
    told = [event.data for event in events if event.kind == VIOLATION]
    return {name: sum(int(data.get(name, 0)) for data in told) for name in VIOLATION_NAMES}


def foretold(run: DryRun | None) -> tuple[MetricsRow, ...]:
    """The dry run's own policy and chance, under the same conditions; nothing where there was no dry run."""
    if run is None or run.forecast is None:
        return ()
    return forecast_rows(run.forecast)
