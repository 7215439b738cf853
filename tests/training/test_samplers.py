from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from tests_training_small import SMALL_PLACE

from policy.training.samplers import OwnPlace, free_places
from policy.world.airspace import hits_obstacle, inside_area
from policy.world.scenario import Area, Obstacle, Scenario


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**31))
def test_any_place_can_be_flown(seed: int) -> None:
    scenario, pos_enu_m = SMALL_PLACE(np.random.default_rng(seed))
    assert pos_enu_m.shape == (scenario.slots + 1, scenario.num_users, 2)
    assert np.all(inside_area(scenario.launch_enu_m, scenario))
    assert np.all(inside_area(pos_enu_m, scenario))


def test_a_seed_gives_its_campaign_again_and_another_gives_another() -> None:
    places = [SMALL_PLACE(np.random.default_rng(seed)) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(places[0][1], places[1][1])
    assert places[0][0].area.size_m != places[2][0].area.size_m


def test_own_place_takes_some_of_its_users_with_their_own_rates() -> None:
    rng = np.random.default_rng(0)
    users = 10
    rates = np.linspace(0.01, 0.1, users)
    scenario = Scenario(Area((0.0, 0.0), (900.0, 900.0)), np.full((2, 2), 450.0), rates, slots=50)
    pos_enu_m = np.tile(np.arange(users)[None, :, None] * 10.0, (9, 1, 2))
    own = OwnPlace(scenario, pos_enu_m)
    sizes = set()
    for _ in range(20):
        drawn, places = own(rng)
        assert drawn.slots == 8  # as far as the trace goes
        np.testing.assert_allclose(drawn.collect_mbps, rates[np.round(places[0, :, 0] / 10.0).astype(int)])
        sizes.add(drawn.num_users)
    assert min(sizes) >= 6
    assert max(sizes) <= users


def test_launches_are_clear_of_obstacles() -> None:
    tower = Obstacle("tower", 150.0, ((0.0, 0.0), (700.0, 0.0), (700.0, 700.0), (0.0, 700.0)))
    scenario = Scenario(Area((0.0, 0.0), (900.0, 900.0), (tower,)), np.full((3, 2), 850.0), np.full(2, 0.02))
    for seed in range(10):
        places = free_places(scenario, np.random.default_rng(seed))
        assert not np.any(hits_obstacle(places, scenario, scenario.obstacle_margin_m))
    full = replace(tower, polygon_m=((0.0, 0.0), (900.0, 0.0), (900.0, 900.0), (0.0, 900.0)))
    blocked = replace(scenario, area=Area((0.0, 0.0), (900.0, 900.0), (full,)))
    np.testing.assert_array_equal(free_places(blocked, np.random.default_rng(0)), blocked.launch_enu_m)
