"""What a flown campaign is set beside in its report: a dry run of policy and chance, and the paper."""

from collections.abc import Sequence

from gcs.cli.flight_results import FlownCampaign
from gcs.forecast.estimate import DryRunOrder, estimate
from gcs.mission.order import FlightSettings, fleet_limits, planning_scenario
from gcs.ports import VehicleStatus
from gcs.report import MetricsRow
from gcs.report.forecast_rows import forecast_rows
from gcs.report.paper_row import paper_rows
from gcs.report.repeat import mission_as_flown


def comparison(flown: FlownCampaign, vehicles: Sequence[VehicleStatus]) -> tuple[MetricsRow, ...]:
    """Lines of the report, under the limits that the flight itself was planned with."""
    limits = fleet_limits(flown.scenario, [vehicle.limits for vehicle in vehicles])
    planned = planning_scenario(flown.scenario, limits, FlightSettings())
    directory = None if flown.mission.directory is None else str(flown.mission.directory)
    document = mission_as_flown(flown.mission, flown.policy.name, flown.policy.checkpoint)
    order = DryRunOrder(document, directory, planned.max_speed_mps, planned.max_accel_mps2)
    return forecast_rows(estimate(order)) + paper_rows(flown.mission)
