"""Small campaigns for the tests of this room."""

import math

import numpy as np

from policy.world.scenario import Area, Obstacle, Scenario


def make_scenario(
    num_uavs: int = 2, num_users: int = 5, accel: float = math.inf, obstacles: tuple[Obstacle, ...] = ()
) -> Scenario:
    """A campus of 1600 x 1200 m, launch in its middle."""
    return Scenario(
        area=Area((40.42, -86.93), (1600.0, 1200.0), obstacles),
        launch_enu_m=np.tile([[800.0, 600.0]], (num_uavs, 1)),
        collect_mbps=np.full(num_users, 0.02),
        max_accel_mps2=accel,
    )


TOWER = Obstacle("tower", 150.0, ((900.0, 500.0), (1000.0, 500.0), (1000.0, 700.0), (900.0, 700.0)))
HUT = Obstacle("hut", 20.0, ((100.0, 100.0), (140.0, 100.0), (140.0, 140.0), (100.0, 140.0)))
