"""Named weights of the objective (Eq. 8 and the two terms that the paper only measures)."""

from dataclasses import replace

from policy.mission_file.schema import ObjectiveSection
from policy.world.scenario import Objective

FRESH = Objective()
"""Least AoI: the paper's reward as it stands."""

BALANCED = replace(FRESH, c_cover=10.0, c_energy=500.0)
"""All four metrics: a served user is worth as much as one slot of AoI (c_aoi), and a slot at full speed, about
0.0066 of a battery, costs a third of that."""

_PRESETS = {"fresh": FRESH, "balanced": BALANCED}


def objective_of(section: ObjectiveSection) -> Objective:
    """The preset with the weights that the section gives explicitly."""
    explicit = section.model_dump(exclude={"preset"}, exclude_none=True)
    return replace(_PRESETS[section.preset], **explicit)
