"""Colours for the age of information.

Grey is normal, colour is abnormal (ISA-101): fresh is a quiet grey, and the older the more salient. The steps rise
steadily in contrast and in size, so that they can be told apart without seeing hue. The operator page
(``gcs/dashboard/src/aoi.ts``) uses the same bounds and names; the colours themselves stand in the style sheets.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class AoiStep:
    """Ages below ``below_slots`` and not below the step before."""

    css_class: str
    label: str
    below_slots: float


AOI_STEPS = (
    AoiStep("aoi-0", "1 (just served)", 2.0),
    AoiStep("aoi-1", "2 to 4", 5.0),
    AoiStep("aoi-2", "5 to 9", 10.0),
    AoiStep("aoi-3", "10 to 19", 20.0),
    AoiStep("aoi-4", "20 or more", float("inf")),
)


def aoi_step(aoi_slots: float) -> int:
    """Index of the step that an age belongs to."""
    return next(index for index, step in enumerate(AOI_STEPS) if aoi_slots < step.below_slots)
