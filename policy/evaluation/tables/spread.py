"""Mean and deviation over the seeds of a point."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

METRICS: Mapping[str, str] = {
    "episodic_aoi": "κ",
    "data_collection_ratio": "ψ",
    "user_coverage": "ρ",
    "energy_ratio": "ζ",
}
"""The paper's four, by our names."""


@dataclass(frozen=True)
class Spread:
    """One metric over K seeds; ``std`` is of these seeds (divided by K), as in the result object."""

    mean: float
    std: float
    seeds: int

    def __str__(self) -> str:
        """As the tables show it."""
        return f"{self.mean:.3f} ± {self.std:.3f}" if self.seeds > 1 else f"{self.mean:.3f}"


def spread(cells: Sequence[Mapping[str, Any]], metric: str) -> Spread | None:
    """None where no cell of the point was flown."""
    values = [cell["metrics"][metric] for cell in cells]
    return Spread(float(np.mean(values)), float(np.std(values)), len(values)) if values else None
