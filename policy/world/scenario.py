"""Everything about a campaign that does not change while it runs."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from policy.world.arrays import FloatArray
from policy.world.channel import Radio, serving_radius_m
from policy.world.energy import battery_energy_j
from policy.world.frames import LocalFrame
from policy.world.geometry import Polygon


@dataclass(frozen=True)
class Obstacle:
    """A building with a vertical wall around ``polygon_m``; matters where it is as high as the UAVs fly."""

    name: str
    height_m: float
    polygon_m: Polygon


@dataclass(frozen=True)
class Area:
    """The task area: a rectangle east and north of its south-west corner."""

    south_west_deg: tuple[float, float]  # latitude, longitude
    size_m: tuple[float, float]  # east, north
    obstacles: tuple[Obstacle, ...] = ()

    @property
    def frame(self) -> LocalFrame:
        """Local metres of this area."""
        return LocalFrame(*self.south_west_deg)


@dataclass(frozen=True)
class Objective:
    """Weights of the reward (Eq. 8) and of what the paper names as metrics beside it."""

    gamma: float = 0.95
    c_collect: float = 1.0
    c_aoi: float = 10.0
    c_cover: float = 0.0  # per user served, as a share of all: a bonus that the paper's reward lacks
    c_energy: float = 0.0  # per joule spent, as a share of one UAV's battery
    penalty: float = 10.0  # r_t^-: per UAV that meets an obstacle, leaves the area or runs empty


@dataclass(frozen=True)
class Scenario:
    """The fixed part of a campaign. Arrays: ``launch_enu_m`` [U, 2], ``collect_mbps`` [M]."""

    area: Area
    launch_enu_m: FloatArray
    collect_mbps: FloatArray
    slots: int = 120
    slot_s: float = 15.0
    altitude_m: float = 120.0
    max_speed_mps: float = 18.0
    max_accel_mps2: float = math.inf  # infinite: the paper's motion
    battery_j: float = field(default_factory=lambda: battery_energy_j(4500.0, 22.2))
    radio: Radio = field(default_factory=Radio)
    objective: Objective = field(default_factory=Objective)
    obstacle_margin_m: float = 15.0
    layer_m: float = 5.0  # vertical spacing between own UAVs, downward from altitude_m

    @property
    def num_uavs(self) -> int:
        """U."""
        return int(self.launch_enu_m.shape[0])

    @property
    def num_users(self) -> int:
        """M."""
        return int(self.collect_mbps.shape[0])

    @cached_property
    def mean_slot_mb(self) -> float:
        """What a user collects in a slot, on average; 0 where there is none."""
        return float(np.mean(self.collect_mbps)) * self.slot_s if self.num_users else 0.0

    @property
    def serving_radius_m(self) -> float:
        """Horizontal reach of a UAV by Eq. 1-3."""
        return serving_radius_m(self.altitude_m, self.radio)

    @property
    def blocking_obstacles(self) -> tuple[Obstacle, ...]:
        """Obstacles that reach the lowest UAV's altitude, less the margin kept above roofs."""
        lowest_m = self.altitude_m - self.layer_m * (self.num_uavs - 1)
        return tuple(o for o in self.area.obstacles if o.height_m >= lowest_m - self.obstacle_margin_m)

    def with_accel(self, max_accel_mps2: float) -> "Scenario":
        """The same campaign flown by vehicles of another acceleration limit."""
        return replace(self, max_accel_mps2=max_accel_mps2)

    def with_uavs(self, num_uavs: int) -> "Scenario":
        """The same campaign with another number of UAVs, all from the first launch point."""
        return replace(self, launch_enu_m=np.tile(self.launch_enu_m[:1], (num_uavs, 1)))

    def with_mcl(self, mcl_db: float) -> "Scenario":
        """The same campaign at another maximum coupling loss."""
        return replace(self, radio=replace(self.radio, mcl_db=mcl_db))

    def with_users(self, num_users: int) -> "Scenario":
        """The same campaign with the first user's collection rate for each of ``num_users``."""
        return replace(self, collect_mbps=np.full(num_users, float(self.collect_mbps[0])))
