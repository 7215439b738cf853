"""A dry run's forecast as lines of the comparison."""

from collections.abc import Mapping
from typing import Any

from gcs.report.data import MetricsRow
from policy.world.metrics import Metrics


def forecast_rows(forecast: Mapping[str, Any]) -> tuple[MetricsRow, MetricsRow]:
    """The policy's own and chance's, under the same conditions; ``forecast`` is that of ``gcs.forecast.estimate``."""
    limits = f"at most {forecast['max_speed_mps']:.1f} m/s and {forecast['max_accel_mps2']:.1f} m/s², no wind"
    baseline = forecast["baseline"]
    return (
        MetricsRow(f"{forecast['policy']} (dry run)", Metrics(**forecast["metrics"]), f"foretold: {limits}"),
        MetricsRow(f"{baseline['policy']} (dry run)", Metrics(**baseline["metrics"]), limits),
    )
