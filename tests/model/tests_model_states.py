"""States for the tests of this folder."""

import numpy as np

from policy.model.features import Features, make_features
from policy.model.states import STEPS, StateBatch, Units
from policy.world.scenario import Area, Scenario


def small_units(users: int = 5) -> Units:
    area = Area((0.0, 0.0), (1500.0, 1200.0))
    return Units.of(Scenario(area, np.zeros((2, 2)), np.full(users, 0.02), max_accel_mps2=4.5))


def random_states(rng: np.random.Generator, batch: int, uavs: int, users: int) -> StateBatch:
    uav_active = np.ones((batch, uavs), dtype=np.bool_)
    user_active = np.ones((batch, users), dtype=np.bool_)
    user_active[:, 0] = users == 1
    return StateBatch(
        uav_pos_enu_m=rng.uniform(0.0, 1200.0, (batch, uavs, 2)),
        uav_vel_enu_mps=rng.uniform(-18.0, 18.0, (batch, uavs, 2)),
        uav_energy_j=rng.uniform(1e5, 3e5, (batch, uavs)),
        uav_active=uav_active,
        user_pos_enu_m=rng.uniform(0.0, 1200.0, (batch, users, 2)),
        user_steps_m=rng.normal(0.0, 20.0, (batch, users, STEPS, 2)),
        user_data_mb=rng.uniform(0.0, 3.0, (batch, users)),
        user_aoi_slots=rng.integers(1, 40, (batch, users)).astype(np.float64),
        user_active=user_active,
    )


def random_features(rng: np.random.Generator, batch: int, uavs: int, users: int) -> Features:
    return make_features(random_states(rng, batch, uavs, users), small_units(users))
