"""Documents for the mission tests."""

from collections.abc import Callable

import pytest

GOOD = """\
[campaign]
name = "small"
slots = 10
slot_s = 15.0
[area]
south_west = [47.0, 8.0]
size_m = [1000.0, 800.0]
obstacles = [
  { name = "low", height_m = 30.0, polygon_m = [[10.0, 10.0], [60.0, 10.0], [60.0, 60.0]] },
  { name = "tower", height_m = 130.0, polygon_m = [[100.0, 100.0], [160.0, 100.0], [160.0, 150.0], [100.0, 150.0]] },
]
[fleet]
uavs = 2
altitude_m = 120.0
launch_m = [500.0, 400.0]
[users]
source = "walkers"
count = 5
[policy]
name = "random"
"""


@pytest.fixture
def good() -> str:
    return GOOD


@pytest.fixture
def changed() -> Callable[[str, str], str]:
    """GOOD with one thing replaced."""

    def change(old: str, new: str) -> str:
        assert old in GOOD
        return GOOD.replace(old, new)

    return change
