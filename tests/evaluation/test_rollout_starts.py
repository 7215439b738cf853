"""Start points by seed."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from policy.evaluation.rollout import LAUNCH_JITTER_M, jittered
from policy.world.airspace import hits_obstacle, inside_area
from policy.world.scenario import Area, Obstacle, Scenario

TOWER = Obstacle("tower", 150.0, ((120.0, 50.0), (200.0, 50.0), (200.0, 150.0), (120.0, 150.0)))


def scenario(launch=(80.0, 100.0)) -> Scenario:
    area = Area((47.0, 8.0), (400.0, 300.0), (TOWER,))
    return Scenario(area=area, launch_enu_m=np.array([launch, launch]), collect_mbps=np.full(3, 0.02))


def test_seed_0_starts_at_the_launch_point():
    assert np.array_equal(jittered(scenario(), 0).launch_enu_m, scenario().launch_enu_m)


@given(seed=st.integers(1, 2**31 - 1))
def test_other_seeds_start_near_inside_and_clear_of_obstacles(seed):
    there = scenario()
    moved = jittered(there, seed)
    assert np.all(np.abs(moved.launch_enu_m - there.launch_enu_m) <= LAUNCH_JITTER_M)
    assert np.all(inside_area(moved.launch_enu_m, there))
    assert not np.any(hits_obstacle(moved.launch_enu_m, there, there.obstacle_margin_m))
    assert np.array_equal(moved.launch_enu_m, jittered(there, seed).launch_enu_m)


def test_hemmed_in_by_obstacles_it_stays():
    walls = tuple(
        Obstacle(str(k), 150.0, ((e, n), (e + w, n), (e + w, n + h), (e, n + h)))
        for k, (e, n, w, h) in enumerate(
            [(0, 0, 60, 300), (100.01, 0, 300, 300), (0, 0, 400, 84.9), (0, 115.1, 400, 180)]
        )
    )
    area = Area((47.0, 8.0), (400.0, 300.0), walls)
    boxed = Scenario(area=area, launch_enu_m=np.array([[80.0, 100.0]]), collect_mbps=np.full(3, 0.02))
    assert np.array_equal(jittered(boxed, 3).launch_enu_m, boxed.launch_enu_m)
