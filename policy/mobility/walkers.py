"""Synthetic users: truncated Levy walks with pauses around hot spots, commuting, seen by a receiver.

The walk follows Rhee et al., "On the Levy-walk nature of human mobility" (IEEE/ACM ToN 19(3), 2011): flight
lengths and pauses are truncated Pareto. People gather at hot spots of unequal popularity (Zipf); some travel
between them. What a campaign sees are fixes: taken at intervals, with an error, sometimes on a lattice, as in
the three real sets (see ``docs/mobility.md``).
"""

from dataclasses import dataclass, field

import numpy as np

from policy.mobility.ground import Ground
from policy.mobility.receiver import ReceiverParams, observe
from policy.mobility.traces import UserTraces
from policy.world.arrays import FloatArray
from policy.world.geometry import Polygon

WARM_UP_S = 600.0
"""People are under way already when the campaign begins."""
MAX_TRIES = 30
"""Draws of a next place before a person gives up and stays."""


@dataclass(frozen=True)
class Pareto:
    """Truncated Pareto: density ~ x^-(1 + exponent) on [low, high]."""

    low: float
    high: float
    exponent: float

    def draw(self, rng: np.random.Generator) -> float:
        """One value, by inverting the distribution function."""
        low, high = self.low**-self.exponent, self.high**-self.exponent
        return float((low - rng.random() * (low - high)) ** (-1.0 / self.exponent))


@dataclass(frozen=True)
class WalkerParams:
    """What kind of crowd; ``policy.mobility.presets`` fits it to real ones."""

    hot_spots: int = 8
    zipf_exponent: float = 1.0  # popularity of the k-th hot spot ~ k^-exponent
    reach: tuple[float, float] = (0.6, 0.6)  # share of the area's east and north side in which hot spots lie
    hot_spot_sigma_m: float = 40.0
    still_share: float = 0.05  # users who never move
    commuter_share: float = 0.5  # users who travel between hot spots
    commute_probability: float = 0.3  # of a commuter's next trip leading to another hot spot
    return_probability: float = 0.3  # of another trip leading back to the own hot spot: attraction
    pause_s: Pareto = field(default_factory=lambda: Pareto(30.0, 3600.0, 0.6))
    flight_m: Pareto = field(default_factory=lambda: Pareto(5.0, 300.0, 1.0))
    walk_mps: float = 1.3  # mean walking speed
    ride_mps: float = 6.0  # mean speed of a commute that is ridden
    ride_share: float = 0.3  # commutes that are ridden
    receiver: ReceiverParams = field(default_factory=ReceiverParams)


@dataclass(frozen=True)
class Town:
    """The ground with its hot spots, shared by all users of one seed."""

    ground: Ground
    spots_m: FloatArray  # [K, 2]
    popularity: FloatArray  # [K], sums to 1

    def draw_spot(self, rng: np.random.Generator) -> int:
        """A hot spot by popularity."""
        return int(rng.choice(self.popularity.size, p=self.popularity))


def generate_walkers(
    num_users: int,
    num_samples: int,
    slot_s: float,
    area_size_m: tuple[float, float],
    seed: int,
    *,
    params: WalkerParams | None = None,
    obstacles: tuple[Polygon, ...] = (),
) -> UserTraces:
    """``num_users`` walkers at ``num_samples`` samples; the same arguments give the same walkers.

    Always inside the area (``[0, east] x [0, north]``) and outside ``obstacles``. Raises ``ValueError`` where
    nobody would have room.
    """
    if num_users < 1 or num_samples < 1 or slot_s <= 0.0 or min(area_size_m) <= 0.0:
        raise ValueError("walkers need at least one user, one sample, a positive slot and a positive area")
    params = params or WalkerParams()
    town_rng, *user_rngs = np.random.default_rng(seed).spawn(num_users + 1)
    town = _build_town(town_rng, Ground(area_size_m, obstacles), params)
    time_s = slot_s * np.arange(num_samples, dtype=np.float64)
    paths = [_Person(rng, town, params).walk(time_s) for rng in user_rngs]
    still = np.array([not moves for _, moves in paths])
    true_m = np.stack([path for path, _ in paths], axis=1)
    seen_m = observe(town_rng, town.ground, true_m, still, params.receiver)
    ids = tuple(f"w{user}" for user in range(num_users))
    return UserTraces(ids, seen_m, slot_s, f"walkers, seed {seed}")


def _build_town(rng: np.random.Generator, ground: Ground, params: WalkerParams) -> Town:
    size_m, reach = np.asarray(ground.area_size_m), np.asarray(params.reach)
    low, high = 0.5 * size_m * (1.0 - reach), 0.5 * size_m * (1.0 + reach)
    spots = [_free_place(rng, ground, low, high) for _ in range(params.hot_spots)]
    popularity = np.arange(1, params.hot_spots + 1) ** -params.zipf_exponent
    return Town(ground, np.stack(spots), popularity / popularity.sum())


def _free_place(rng: np.random.Generator, ground: Ground, low_m: FloatArray, high_m: FloatArray) -> FloatArray:
    """Uniform in the box; in the whole area where the box is full of obstacles."""
    whole = (np.zeros(2), np.asarray(ground.area_size_m))
    for box_low, box_high in ((low_m, high_m), whole):
        candidates = rng.uniform(box_low, box_high, size=(1000, 2))
        free = np.flatnonzero(ground.free(candidates))
        if free.size:
            return np.asarray(candidates[free[0]])
    raise ValueError("the obstacles leave no room for users: make them smaller or the area larger")


@dataclass(frozen=True)
class _Person:
    """One user under way: with own randomness, so that nobody's way depends on how many others there are."""

    rng: np.random.Generator
    town: Town
    params: WalkerParams

    def walk(self, time_s: FloatArray) -> tuple[FloatArray, bool]:
        """The true path at ``time_s``: [N, 2], and whether this person moves at all."""
        home = self.town.draw_spot(self.rng)
        place = self._start(home)
        if self._happens(self.params.still_share):
            return np.tile(place, (time_s.size, 1)), False
        commuter = self._happens(self.params.commuter_share)
        now_s = -WARM_UP_S
        knot_s, knot_m = [now_s], [place]
        while now_s <= time_s[-1]:
            commutes = commuter and self._happens(self.params.commute_probability)
            home = self.town.draw_spot(self.rng) if commutes else home
            target = self._target(place, home if commutes or self._returns() else None)
            leave_s = now_s + self.params.pause_s.draw(self.rng)
            now_s = leave_s + float(np.linalg.norm(target - place)) / self._speed_mps(commutes)
            knot_s += [leave_s, now_s]
            knot_m += [place, target]
            place = target
        corners_m = np.stack(knot_m)
        return np.stack([np.interp(time_s, knot_s, corners_m[:, axis]) for axis in (0, 1)], axis=-1), True

    def _happens(self, probability: float) -> bool:
        return bool(self.rng.random() < probability)

    def _returns(self) -> bool:
        return self._happens(self.params.return_probability)

    def _speed_mps(self, commutes: bool) -> float:
        if commutes and self._happens(self.params.ride_share):
            return self.params.ride_mps * float(self.rng.uniform(0.5, 1.5))
        return self.params.walk_mps * float(self.rng.uniform(0.7, 1.3))

    def _target(self, place: FloatArray, spot: int | None) -> FloatArray:
        """A place near ``spot``, or one Levy flight away, with a clear way to it; ``place`` where none is."""
        for _ in range(MAX_TRIES):
            target = self._around(spot) if spot is not None else place + self._flight()
            if self.town.ground.clear_way(place, target):
                return target
        return place

    def _flight(self) -> FloatArray:
        bearing = self.rng.uniform(0.0, 2.0 * np.pi)
        return self.params.flight_m.draw(self.rng) * np.array([np.sin(bearing), np.cos(bearing)])

    def _around(self, spot: int) -> FloatArray:
        scatter_m = self.params.hot_spot_sigma_m * self.rng.standard_normal(2)
        return np.asarray(self.town.spots_m[spot] + scatter_m, dtype=np.float64)

    def _start(self, spot: int) -> FloatArray:
        """Around the hot spot, or on it where all around is blocked."""
        tries = (self._around(spot) for _ in range(MAX_TRIES))
        return next((place for place in tries if self.town.ground.free(place)), self.town.spots_m[spot])
