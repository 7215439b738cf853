"""Reading the telemetry that the journal wrote."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import Engine, select
from sqlalchemy.orm import Session

from gcs.ports import TelemetrySample
from gcs.store.models import TelemetryRow
from gcs.store.vehicle_rows import vehicle_statuses


@dataclass(frozen=True)
class SampleTime:
    """When a sample was taken: on the flight clock of the server that flew, and on the wall clock."""

    id: int
    time_s: float
    recorded_at: datetime


@dataclass(frozen=True)
class Telemetry:
    """The samples of campaigns, in the order in which they were taken."""

    engine: Engine

    def times(self, campaign_id: str) -> Sequence[SampleTime]:
        """When each sample was taken, without what it says."""
        columns = (TelemetryRow.id, TelemetryRow.time_s, TelemetryRow.recorded_at)
        query = select(*columns).where(TelemetryRow.campaign_id == campaign_id).order_by(TelemetryRow.id)
        with Session(self.engine) as session:
            return [SampleTime(*row) for row in session.execute(query)]

    def part(self, campaign_id: str, first: int, limit: int) -> Sequence[tuple[SampleTime, TelemetrySample]]:
        """At most ``limit`` samples from id ``first`` on."""
        wanted = (TelemetryRow.campaign_id == campaign_id) & (TelemetryRow.id >= first)
        with Session(self.engine) as session:
            rows = session.scalars(select(TelemetryRow).where(wanted).order_by(TelemetryRow.id).limit(limit))
            return [(SampleTime(row.id, row.time_s, row.recorded_at), _sample(row)) for row in rows]

    def rows(self, campaign_id: str) -> Sequence[tuple[float, list[Any]]]:
        """(time_s, rows of vehicles) of all samples, as an export has them."""
        columns = (TelemetryRow.time_s, TelemetryRow.vehicles)
        query = select(*columns).where(TelemetryRow.campaign_id == campaign_id).order_by(TelemetryRow.id)
        with Session(self.engine) as session:
            return [(time_s, vehicles) for time_s, vehicles in session.execute(query)]


def _sample(row: TelemetryRow) -> TelemetrySample:
    return TelemetrySample(row.time_s, vehicle_statuses(row.vehicles))
