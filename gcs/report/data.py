"""What a report is made of."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from gcs.ports import CampaignState, Event, SlotRecord
from policy.world.metrics import Metrics
from policy.world.scenario import Scenario


@dataclass(frozen=True)
class MetricsRow:
    """One line of the comparison: another policy's scores, or the same policy's under other conditions."""

    label: str
    metrics: Metrics  # ``final_aoi`` is NaN where the source does not give one
    note: str = ""

    @property
    def final_aoi(self) -> float | None:
        """AoI after the last slot; None where the source does not give it."""
        return self.metrics.final_aoi if math.isfinite(self.metrics.final_aoi) else None


@dataclass(frozen=True)
class Provenance:
    """Everything needed to fly the campaign again."""

    command: str = ""  # one line for a shell, as it was given
    repeat: str = ""  # one line that flies ``mission`` again, in the folder with the report's mission.toml
    mission: Mapping[str, Any] = field(default_factory=dict)  # the mission document as flown
    seed: int | None = None
    versions: Mapping[str, str] = field(default_factory=dict)  # name -> version
    machine: str = ""
    commit: str = ""  # of the sources, where they are a clone
    checkpoint: str = ""  # of the policy, when it has one
    sha256: Mapping[str, str] = field(default_factory=dict)  # file that decided the outcome -> its digest
    begun_utc: str = ""  # ISO 8601, wall clock
    wall_s: float | None = None  # how long the flight took on the wall clock


@dataclass(frozen=True)
class ReportData:
    """A flown campaign. ``records`` holds slot 0 (the start) to the last slot flown, in order."""

    name: str
    policy: str
    scenario: Scenario
    records: tuple[SlotRecord, ...]
    comparison: tuple[MetricsRow, ...] = ()  # beside the flight: random, ideal motion, ...
    events: tuple[Event, ...] = ()
    violations: Mapping[str, int] = field(default_factory=dict)  # UAV-slots by kind
    provenance: Provenance = field(default_factory=Provenance)
    state: str = "done"  # the campaign's last state
    reason: str = ""  # why it ended early, if it did

    def __post_init__(self) -> None:
        slots = [record.slot for record in self.records]
        if not slots:
            raise ValueError("a report needs at least the record of slot 0; fly or load the campaign first")
        if any(later <= earlier for earlier, later in pairwise(slots)):
            raise ValueError(f"slot records must be in rising order, got slots {slots}")

    @property
    def ended_early(self) -> bool:
        """It is over and did not come to its end."""
        return self.state in {CampaignState.ABORTED, CampaignState.FAILED}

    @property
    def flown(self) -> tuple[SlotRecord, ...]:
        """The records after a slot, without the start."""
        return tuple(record for record in self.records if record.slot > 0)

    @property
    def metrics(self) -> Metrics | None:
        """The campaign's scores; None when it ended before its first slot did."""
        return next((record.metrics for record in reversed(self.records) if record.metrics is not None), None)
