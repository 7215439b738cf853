"""The discrete actions that planners and learners choose from."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from policy.world.arrays import FloatArray
from policy.world.frames import velocity_enu_mps


@dataclass(frozen=True)
class ActionSet:
    """A actions of one UAV; index 0 hovers. ``heading_rad`` [A], ``speed_mps`` [A]."""

    heading_rad: FloatArray
    speed_mps: FloatArray

    @property
    def size(self) -> int:
        """A."""
        return int(self.speed_mps.shape[0])

    @cached_property
    def vel_enu_mps(self) -> FloatArray:
        """Velocities [A, 2]."""
        return np.asarray(velocity_enu_mps(self.heading_rad, self.speed_mps), dtype=np.float64)


def make_actions(num_headings: int, speeds_mps: tuple[float, ...]) -> ActionSet:
    """Hover, then every heading at every speed: A = 1 + num_headings * len(speeds_mps)."""
    if num_headings < 1 or not speeds_mps or min(speeds_mps) <= 0.0:
        raise ValueError(f"need at least one heading and positive speeds, not {num_headings} and {speeds_mps}")
    headings = np.arange(num_headings) * (2.0 * math.pi / num_headings)
    return ActionSet(
        heading_rad=np.concatenate(([0.0], np.tile(headings, len(speeds_mps)))),
        speed_mps=np.concatenate(([0.0], np.repeat(np.asarray(speeds_mps), num_headings))),
    )


def paper_actions(max_speed_mps: float) -> ActionSet:
    """The nine actions of the paper's experiments: hover and eight headings at full speed."""
    return make_actions(8, (max_speed_mps,))
