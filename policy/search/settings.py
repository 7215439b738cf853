"""What a search is told to do: how far, how wide, with which moves."""

import math
from dataclasses import dataclass

from policy.world.actions import ActionSet, make_actions
from policy.world.scenario import Scenario


@dataclass(frozen=True)
class SearchSettings:
    """Quality against time; `docs/planner.md` has the measured trade-off."""

    horizon_slots: int = 15  # H
    beam: int = 32  # K, paths kept a depth
    rounds: int = 2  # times that each UAV is planned anew from the kept plans
    rebuilds: int = 2  # UAVs whose plan is thrown away for a try without it, a slot
    num_headings: int = 16
    speed_shares: tuple[float, ...] = (1.0,)  # of the greatest speed; hovering is always there
    leaf_weight: float = 0.6  # of AoI x slots to reach, against the AoI that the horizon counts
    discount: float = 1.0  # a slot; Eq. 7 weighs all slots alike
    cell_m: float = 30.0  # paths that end in one cell with one AoI of every user are one path

    def __post_init__(self) -> None:
        """Refuse what cannot be searched."""
        if min(self.horizon_slots, self.beam, self.rounds, self.num_headings) < 1:
            raise ValueError(f"horizon_slots, beam, rounds and num_headings must be at least 1: {self}")
        if not self.speed_shares or not all(0.0 < share <= 1.0 for share in self.speed_shares):
            raise ValueError(f"speed_shares must lie in (0, 1] and not be empty: {self.speed_shares}")
        if not 0.0 < self.discount <= 1.0 or min(self.leaf_weight, self.rebuilds) < 0.0 or self.cell_m <= 0.0:
            raise ValueError(f"need 0 < discount <= 1, leaf_weight >= 0 and cell_m > 0: {self}")


def settings_for(scenario: Scenario, fast: bool = False) -> SearchSettings:
    """What flies by default: fine headings for the paper's motion; with inertia, speeds to turn at as well.

    ``fast`` decides in a quarter of the time for a few per cent more AoI (figures in `docs/planner.md`).
    """
    inertia = math.isfinite(scenario.max_accel_mps2)
    if fast:
        return SearchSettings(horizon_slots=10, beam=16, rebuilds=1, speed_shares=(0.6, 1.0) if inertia else (1.0,))
    if inertia:
        return SearchSettings(speed_shares=(5 / 9, 7 / 9, 1.0))
    return SearchSettings(num_headings=32, beam=48)


def search_actions(scenario: Scenario, settings: SearchSettings) -> ActionSet:
    """The moves to choose from. No faster than a vehicle can brake from within a slot, so that plans end known."""
    top_mps = min(scenario.max_speed_mps, scenario.max_accel_mps2 * scenario.slot_s)
    speeds = tuple(sorted({share * top_mps for share in settings.speed_shares}, reverse=True))
    return make_actions(settings.num_headings, speeds)
