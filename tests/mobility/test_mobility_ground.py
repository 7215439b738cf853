"""Ways that would lead through a wall or off the map are seen as such."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policy.mobility.ground import Ground

SQUARE = ((40.0, 40.0), (60.0, 40.0), (60.0, 60.0), (40.0, 60.0))
GROUND = Ground((100.0, 100.0), (SQUARE,))
places = st.tuples(st.floats(0.0, 100.0), st.floats(0.0, 100.0)).map(np.array)


@pytest.mark.parametrize(
    ("place", "free"), [((50.0, 50.0), False), ((30.0, 50.0), True), ((0.0, 100.0), True), ((101.0, 5.0), False)]
)
def test_free_is_inside_the_area_and_outside_obstacles(place: tuple[float, float], free: bool) -> None:
    assert GROUND.free(np.array(place)) == free


@pytest.mark.parametrize(
    ("start", "end", "clear"),
    [
        ((10.0, 50.0), (90.0, 50.0), False),  # through it
        ((10.0, 50.0), (39.0, 50.0), True),  # up to it
        ((10.0, 50.0), (50.0, 50.0), False),  # into it
        ((30.0, 45.0), (45.0, 30.0), True),  # past its corner
        ((30.0, 55.0), (55.0, 30.0), False),  # across its corner
        ((10.0, 10.0), (10.0, 101.0), False),  # off the map
    ],
)
def test_clear_ways(start: tuple[float, float], end: tuple[float, float], clear: bool) -> None:
    assert GROUND.clear_way(np.array(start), np.array(end)) == clear


@given(start=places, end=places)
def test_every_point_of_a_clear_way_is_free(start: np.ndarray, end: np.ndarray) -> None:
    if GROUND.free(start) and GROUND.clear_way(start, end):
        points = start + np.linspace(0.0, 1.0, 50)[:, None] * (end - start)
        assert np.all(GROUND.free(np.clip(points, 0.0, 100.0)))
