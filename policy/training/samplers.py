"""What training campaigns are drawn from: crowds and places that differ every time, or one place's own users."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from policy.mobility.receiver import ReceiverParams
from policy.mobility.walkers import Pareto, WalkerParams, generate_walkers
from policy.world.airspace import hits_obstacle
from policy.world.arrays import FloatArray
from policy.world.scenario import Area, Scenario

TraceSampler = Callable[[np.random.Generator], tuple[Scenario, FloatArray]]
"""For each episode a campaign and its users' places [T+1, M, 2]."""


@dataclass(frozen=True)
class AnyPlace:
    """Synthetic walkers in areas, crowds, fleets and radios of random kind: no real place, none twice.

    The ranges are round numbers around what a campus may be, not fits to the real sets.
    """

    slots: int = 120
    slot_s: float = 15.0
    side_m: tuple[float, float] = (1000.0, 3500.0)
    even_sides: bool = False  # all sides equally likely; else all ratios of sides are, which makes large places rare
    users: tuple[int, int] = (20, 90)
    uavs: tuple[int, ...] = (1, 2, 2, 2, 3, 4)
    mcl_db: tuple[float, ...] = (117.0, 117.0, 117.0, 115.0, 119.0)
    accel_mps2: tuple[float, ...] = (math.inf, math.inf, 4.5, 2.5)

    @property
    def description(self) -> str:
        """For the model card."""
        accel = ", ".join(f"{limit:g}" for limit in sorted(set(self.accel_mps2)))
        return (
            f"synthetic walkers only: areas {self.side_m[0]:g} to {self.side_m[1]:g} m a side, {self.users[0]} to "
            f"{self.users[1]} users, {min(self.uavs)} to {max(self.uavs)} UAVs from random places, MCL "
            f"{min(self.mcl_db):g} to {max(self.mcl_db):g} dB, acceleration limits {accel} m/s2; "
            "crowd parameters random in each episode, no real trace"
        )

    def __call__(self, rng: np.random.Generator) -> tuple[Scenario, FloatArray]:
        """One campaign."""
        size_m = self._size_m(rng)
        users, uavs = int(rng.integers(self.users[0], self.users[1] + 1)), int(rng.choice(self.uavs))
        scenario = Scenario(
            area=Area((0.0, 0.0), (size_m[0], size_m[1])),
            launch_enu_m=rng.uniform(0.0, size_m, size=(uavs, 2)),
            collect_mbps=np.full(users, 0.02),
            slots=self.slots,
            slot_s=self.slot_s,
            max_accel_mps2=float(rng.choice(self.accel_mps2)),
        ).with_mcl(float(rng.choice(self.mcl_db)))
        seed = int(rng.integers(2**31))
        walkers = generate_walkers(
            users, self.slots + 1, self.slot_s, (size_m[0], size_m[1]), seed, params=random_crowd(rng)
        )
        return scenario, walkers.pos_enu_m

    def _size_m(self, rng: np.random.Generator) -> tuple[float, float]:
        if self.even_sides:
            sides = rng.uniform(self.side_m[0], self.side_m[1], size=2)
        else:
            least, greatest = np.log(self.side_m)
            sides = np.exp(rng.uniform(least, greatest, size=2))
        return float(sides[0]), float(sides[1])


WIDE_PLACES = AnyPlace(side_m=(1000.0, 4000.0), even_sides=True)
"""For values: where users are slots away from the nearest UAV, a search depends on them most."""


def random_crowd(rng: np.random.Generator) -> WalkerParams:
    """Between people who hardly stir and people who cross the place all the time."""
    return WalkerParams(
        hot_spots=int(rng.integers(3, 31)),
        zipf_exponent=float(rng.uniform(0.3, 1.6)),
        reach=(float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.5, 1.0))),
        hot_spot_sigma_m=float(rng.uniform(10.0, 120.0)),
        still_share=float(rng.uniform(0.0, 0.3)),
        commuter_share=float(rng.uniform(0.0, 0.8)),
        commute_probability=float(rng.uniform(0.05, 0.6)),
        return_probability=float(rng.uniform(0.0, 0.4)),
        pause_s=Pareto(float(rng.uniform(10.0, 60.0)), 3600.0, float(rng.uniform(0.1, 0.7))),
        flight_m=Pareto(4.0, float(rng.uniform(150.0, 400.0)), float(rng.uniform(0.4, 1.8))),
        ride_mps=float(rng.uniform(5.0, 13.0)),
        ride_share=float(rng.uniform(0.0, 0.5)),
        receiver=ReceiverParams(
            interval_samples=int(rng.integers(1, 3)),
            error_m=float(rng.uniform(1.0, 8.0)),
            error_spread=float(rng.uniform(0.2, 1.0)),
            jump_probability=float(rng.uniform(0.1, 0.7)),
            jump_concentration=float(10.0 ** rng.uniform(-1.0, 1.0)),
        ),
    )


@dataclass(frozen=True)
class OwnPlace:
    """One mission's users, all or a random part of them, with launch points anywhere: for a place's own model."""

    scenario: Scenario
    pos_enu_m: FloatArray  # [T+1, M, 2]
    least_share: float = 0.6  # of the users that an episode takes

    @property
    def description(self) -> str:
        """For the model card."""
        return f"the mission's own {self.pos_enu_m.shape[1]} users, {self.least_share:.0%} to all of them an episode"

    def __call__(self, rng: np.random.Generator) -> tuple[Scenario, FloatArray]:
        """One campaign."""
        users = self.pos_enu_m.shape[1]
        taken = int(rng.integers(max(1, math.ceil(self.least_share * users)), users + 1))
        chosen = np.sort(rng.permutation(users)[:taken])
        launched = replace(self.scenario, launch_enu_m=free_places(self.scenario, rng))
        slots = min(self.scenario.slots, self.pos_enu_m.shape[0] - 1)
        return (
            replace(launched, slots=slots, collect_mbps=self.scenario.collect_mbps[chosen]),
            self.pos_enu_m[: slots + 1, chosen],
        )


@dataclass(frozen=True)
class Mixture:
    """Half of the episodes from ``new`` (crowds that differ every time), half from one of ``known`` in turn by chance:
    for a network that is to fly where it has never been.
    """

    new: AnyPlace
    known: tuple[OwnPlace, ...]
    names: str = ""  # of the known places, for the card

    @property
    def description(self) -> str:
        """For the model card."""
        return f"half of the episodes: {self.new.description}; the other half: users of {self.names}"

    def __call__(self, rng: np.random.Generator) -> tuple[Scenario, FloatArray]:
        """One campaign."""
        if rng.random() < 0.5:
            return self.new(rng)
        return self.known[int(rng.integers(len(self.known)))](rng)


def free_places(scenario: Scenario, rng: np.random.Generator, tries: int = 200) -> FloatArray:
    """Random launch points [U, 2] clear of obstacles; the mission's own where none is found."""
    places = np.array(scenario.launch_enu_m, dtype=np.float64)
    for uav in range(scenario.num_uavs):
        drawn = rng.uniform(0.0, scenario.area.size_m, size=(tries, 2))
        clear = drawn[~hits_obstacle(drawn, scenario, scenario.obstacle_margin_m)]
        if clear.size:
            places[uav] = clear[0]
    return places
