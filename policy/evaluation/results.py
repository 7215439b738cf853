"""The result object that evaluation, flights and reports share (``--json``)."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from policy.evaluation.files import write_text
from policy.world.metrics import Metrics

METRIC_NAMES = ("episodic_aoi", "data_collection_ratio", "user_coverage", "energy_ratio", "final_aoi")
VIOLATION_NAMES = ("geofence", "separation", "obstacle", "battery")


@dataclass(frozen=True)
class CampaignResult:
    """One or several campaigns of one policy: ``metrics`` has one entry a seed, in the order of the seeds."""

    mission: str
    policy: str
    uavs: int
    mcl_db: float
    slots: int
    metrics: tuple[Metrics, ...]
    decision_ms: tuple[float, ...]  # all decisions of all seeds; empty when none was timed
    violations: Mapping[str, int]  # UAV-slots in which a rule was broken, all seeds together

    def mean(self, name: str) -> float:
        """Mean of one metric over the seeds."""
        return float(np.mean([getattr(entry, name) for entry in self.metrics]))

    def std(self, name: str) -> float:
        """Standard deviation of one metric over the seeds (of these seeds, not of all that could be)."""
        return float(np.std([getattr(entry, name) for entry in self.metrics]))

    def document(self) -> dict[str, Any]:
        """The JSON object of the contract."""
        return {
            "mission": self.mission,
            "policy": self.policy,
            "uavs": self.uavs,
            "mcl_db": self.mcl_db,
            "slots": self.slots,
            "seeds": len(self.metrics),
            **{name: self._metric(name) for name in METRIC_NAMES},
            "decision_ms": {"p50": self.decision_percentile(50.0), "p99": self.decision_percentile(99.0)},
            "violations": {name: int(self.violations.get(name, 0)) for name in VIOLATION_NAMES},
        }

    def decision_percentile(self, percent: float) -> float | None:
        """Milliseconds of a decision; None when none was timed."""
        return float(np.percentile(self.decision_ms, percent)) if self.decision_ms else None

    def _metric(self, name: str) -> float | dict[str, Any]:
        values = [float(asdict(entry)[name]) for entry in self.metrics]
        if len(values) == 1:
            return values[0]
        return {"mean": self.mean(name), "std": self.std(name), "values": values}


def write_result(path: Path, result: CampaignResult) -> None:
    """Write the JSON object at once. Raises :class:`~policy.evaluation.files.OutputError`."""
    write_text(path, json.dumps(result.document(), indent=2, allow_nan=False) + "\n")


def summed(violations: Sequence[Mapping[str, int]]) -> dict[str, int]:
    """Violations of several campaigns together."""
    return {name: sum(entry.get(name, 0) for entry in violations) for name in VIOLATION_NAMES}
