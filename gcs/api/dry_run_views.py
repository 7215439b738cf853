"""Dry runs as the API tells them."""

from gcs.api.bodies import View
from gcs.api.schemas import MetricsView
from gcs.forecast.dry_runs import DryRun


class SeriesPoint(View):
    """The end of one slot: metrics over all slots until then, the users' mean AoI at that moment."""

    slot: int
    metrics: MetricsView
    mean_aoi_slots: float | None
    decision_ms: float | None


class Baseline(View):
    """What another policy scored under the same conditions."""

    policy: str
    metrics: MetricsView


class Forecast(View):
    """What the campaign would score with these limits of the vehicles, flown in the world model without wind."""

    policy: str
    metrics: MetricsView
    baseline: Baseline
    series: list[SeriesPoint]
    decision_ms: dict[str, float]  # p50, p99
    violations: dict[str, int]  # UAV-slots by kind
    energy_left: list[float]  # of a full battery, a UAV
    max_speed_mps: float
    max_accel_mps2: float


class DryRunView(View):
    """A dry run as it stands."""

    id: str
    name: str
    policy: str
    state: str  # running | done | failed | cancelled
    slot: int
    slots: int
    reason: str
    forecast: Forecast | None


def dry_run_view(run: DryRun) -> DryRunView:
    """In the API's words."""
    return DryRunView(
        id=run.id,
        name=run.name,
        policy=run.policy,
        state=run.state,
        slot=run.slot,
        slots=run.slots,
        reason=run.reason,
        forecast=None if run.forecast is None else Forecast.model_validate(run.forecast),
    )
