import numpy as np
import pytest
from tests_model_states import random_states, small_units

from policy.model.states import StateBatch, Units


@pytest.fixture
def units() -> Units:
    return small_units(users=7)


@pytest.fixture
def states() -> StateBatch:
    """Three states, two UAVs, seven users, of whom the first takes no part."""
    return random_states(np.random.default_rng(1), batch=3, uavs=2, users=7)
