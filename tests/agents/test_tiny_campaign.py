"""The yardstick of the rivals is itself checked: the search against plain enumeration, and against a known campaign."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from tiny_campaign import USERS_M, best_episodic_aoi, tiny_scenario

from policy.environments.single_world import SingleWorld


@pytest.mark.parametrize("slots", [1, 3, 5])
def test_the_search_finds_what_enumerating_every_sequence_finds(slots):
    scenario = replace(tiny_scenario(), slots=slots)
    places = np.tile(USERS_M, (slots + 1, 1, 1))
    best = np.inf
    for sequence in itertools.product((0, 3, 2, 7), repeat=slots):  # hover, east, a diagonal (illegal), west
        world = SingleWorld(scenario, places)
        for action in sequence:
            world.step([action])
        best = min(best, world.metrics()["episodic_aoi"])
    assert best_episodic_aoi(scenario, USERS_M) == pytest.approx(best)
