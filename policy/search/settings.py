"""What a search is told to do: how far, how wide, with which moves."""

import math
from dataclasses import dataclass

from policy.world.actions import ActionSet, make_actions
from policy.world.scenario import Scenario

THRIFT = 0.001
"""Slots of mean AoI a slot at full speed: a user in 60 served one slot sooner outweighs sixteen of them."""
FOLLOW_M = 3.0
"""Real vehicles end their slots within some metres of the plan (guidance's test: 10 m in a wind of 10 m/s)."""
HALF_TURNS_RAD = (math.pi / 4, -math.pi / 4)
"""With inertia a right angle is turned half in the slot before it and half in the one after."""
LAST_WEIGHT = 2.0
"""Slots. What phones still hold when a campaign ends is lost: on KAIST a fifth of that for 0.04 % of AoI."""
MANY_UAVS = 4
HEATED_SWEEPS = 60
"""For two UAVs: they take as long as the rest of a decision."""


@dataclass(frozen=True)
class SearchSettings:
    """Quality against time; `docs/planner.md` has the measured trade-off."""

    horizon_slots: int = 15  # H
    beam: int = 32  # K, paths kept a depth
    rounds: int = 2  # times that each UAV is planned anew from the kept plans
    rebuilds: int = 2  # UAVs whose plan is thrown away for a try without it, a slot
    num_headings: int = 16
    speed_shares: tuple[float, ...] = (1.0,)  # of the greatest speed; hovering is always there
    end_turns_rad: tuple[float, ...] = ()  # with inertia moves at full speed may also end turned so far
    leaf_weight: float = 0.6  # of AoI x slots to reach, against the AoI that the horizon counts
    discount: float = 1.0  # a slot; Eq. 7 weighs all slots alike
    last_weight: float = 0.0  # of ages when the campaign ends, beside their own slot: what phones still hold is lost
    polish_sweeps: int = 0  # along every path, to places between the moves
    heated_sweeps: int = 0  # more of them along the best plan found, while a temperature falls
    thrift: float = 0.0  # slots of mean AoI that the energy of one slot at full speed is worth beside the objective
    follow_m: float = 0.0  # how far beside its plan a UAV may be when a slot ends: plans keep off the discs' edges
    cell_m: float = 30.0  # paths that end in one cell with one AoI of every user are one path

    def __post_init__(self) -> None:
        """Refuse what cannot be searched."""
        if min(self.horizon_slots, self.beam, self.rounds, self.num_headings) < 1:
            raise ValueError(f"horizon_slots, beam, rounds and num_headings must be at least 1: {self}")
        if not self.speed_shares or not all(0.0 < share <= 1.0 for share in self.speed_shares):
            raise ValueError(f"speed_shares must lie in (0, 1] and not be empty: {self.speed_shares}")
        if (
            not 0.0 < self.discount <= 1.0
            or min(self.leaf_weight, self.last_weight, self.rebuilds, self.thrift, self.follow_m) < 0.0
            or min(self.polish_sweeps, self.heated_sweeps) < 0
            or self.cell_m <= 0.0
        ):
            raise ValueError(f"need 0 < discount <= 1, cell_m > 0 and nothing negative: {self}")


def settings_for(scenario: Scenario, fast: bool = False) -> SearchSettings:
    """What flies by default: coarse moves, polished to places between them. The paper's motion: with so little thrift
    that only the speed of otherwise equal plans depends on it. With inertia: a second speed, to turn at, and
    ends turned halfway where a right angle takes most of a slot (elsewhere they cost more of the beam than they gain).

    ``fast`` decides in a third of the time for a few per cent more AoI (figures in `docs/planner.md`). Many UAVs get
    a narrower search each, so that a decision keeps its time.
    """
    many = scenario.num_uavs > MANY_UAVS
    if math.isfinite(scenario.max_accel_mps2):
        if fast:
            return SearchSettings(
                horizon_slots=10,
                beam=12,
                rebuilds=1,
                speed_shares=(0.55, 1.0),
                polish_sweeps=4,
                last_weight=LAST_WEIGHT,
                follow_m=FOLLOW_M,
            )
        right_angle_s = math.sqrt(2.0) * scenario.max_speed_mps / scenario.max_accel_mps2
        is_wide = not many and not scenario.blocking_obstacles  # a move beside walls costs far more to try
        halves = is_wide and right_angle_s > 0.5 * scenario.slot_s
        share = 2.0 / max(scenario.num_uavs, 2)  # three or four UAVs take about the time of two
        beam = round(128 * share) if is_wide else 12 if many else 32
        return SearchSettings(
            horizon_slots=12,
            beam=beam,
            rebuilds=1 if many else 2,
            speed_shares=(0.55, 1.0),
            end_turns_rad=HALF_TURNS_RAD if halves else (),
            polish_sweeps=3 if many else 6,
            heated_sweeps=round(HEATED_SWEEPS * share) if is_wide else 0,
            discount=0.98,
            last_weight=LAST_WEIGHT,
            thrift=THRIFT,
            follow_m=FOLLOW_M,
        )
    if fast:
        return SearchSettings(
            horizon_slots=10, beam=12, rebuilds=1, polish_sweeps=3, last_weight=LAST_WEIGHT, thrift=THRIFT
        )
    return SearchSettings(
        horizon_slots=12,
        beam=20 if many else 28,
        polish_sweeps=4,
        discount=0.98,
        last_weight=LAST_WEIGHT,
        thrift=THRIFT,
    )


def search_actions(scenario: Scenario, settings: SearchSettings) -> ActionSet:
    """The moves to choose from. No faster than a vehicle can brake from within a slot, so that plans end known."""
    top_mps = min(scenario.max_speed_mps, scenario.max_accel_mps2 * scenario.slot_s)
    speeds = tuple(sorted({share * top_mps for share in settings.speed_shares}, reverse=True))
    return make_actions(settings.num_headings, speeds)
