"""Named weights of the objective (Eq. 8 and the two terms that the paper only measures)."""

from dataclasses import replace

from policy.mission_file.schema import ObjectiveSection
from policy.world.scenario import Objective

FRESH = Objective()
"""Least AoI: the paper's reward as it stands."""

BALANCED = replace(FRESH, c_cover=3.0, c_energy=800.0)
"""All four metrics: chosen by receding-horizon on the three campuses among c_cover 2, 3, 5, 10, 30 and c_energy 0
to 2000. More c_cover buys coverage with freshness at a poor rate (NCSU: 10 gives AoI 10), less c_energy leaves UAVs
hovering, which costs more than flying. The measured row: ``docs/missions.md``."""

_PRESETS = {"fresh": FRESH, "balanced": BALANCED}


def objective_of(section: ObjectiveSection) -> Objective:
    """The preset with the weights that the section gives explicitly."""
    explicit = section.model_dump(exclude={"preset"}, exclude_none=True)
    return replace(_PRESETS[section.preset], **explicit)
