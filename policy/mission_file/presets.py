"""Named weights of the objective (Eq. 8 and the two terms that the paper only measures)."""

from dataclasses import replace

from policy.mission_file.schema import ObjectiveSection
from policy.world.scenario import Objective

FRESH = Objective()
"""Least AoI: the paper's reward as it stands."""

BALANCED = replace(FRESH, c_cover=1.0, c_energy=10.0)
"""All four metrics: chosen on the three campuses, ideal motion, among c_cover 0.7, 1, 1.3, 2, 3.
Polished plans save energy by themselves, so its price only breaks ties; 800 costs freshness 15 to 25 %. More c_cover
buys coverage with freshness at a poor rate. Not measured with an acceleration limit. Figures: ``docs/planner.md``."""

_PRESETS = {"fresh": FRESH, "balanced": BALANCED}


def objective_of(section: ObjectiveSection) -> Objective:
    """The preset with the weights that the section gives explicitly."""
    explicit = section.model_dump(exclude={"preset"}, exclude_none=True)
    return replace(_PRESETS[section.preset], **explicit)
