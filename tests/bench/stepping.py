"""How fast the training environments step, on one thread."""

import time
from collections.abc import Callable

import numpy as np
from measures import summary

from policy.world.scenario import Area, Scenario
from policy.world.state import JointAction, WorldState
from policy.world.transition import step
from sitl_mock.batch import BatchFleet

BATCH, UAVS, USERS = 512, 2, 59


def steps_per_second(quick: bool) -> list[tuple[str, str, str]]:
    """The world's own motion, and the mock's physics, both batched."""
    repeats = 3 if quick else 7
    world = _rates(_world_step(), BATCH, repeats)
    mock = _rates(_mock_step(), BATCH * UAVS, repeats)
    return [
        (
            f"`policy.world` on NumPy, {BATCH} campaigns, U = {UAVS}, M = {USERS}",
            summary(world, 1e-3),
            "thousand campaign-slots/s",
        ),
        (f"`sitl_mock` physics, {BATCH} campaigns x {UAVS} vehicles", summary(mock, 1e-3), "thousand vehicle-slots/s"),
    ]


def _rates(slot: Callable[[], None], units: int, repeats: int) -> list[float]:
    slot()
    rates = []
    for _ in range(repeats):
        begun_s = time.perf_counter()
        slot()
        rates.append(units / (time.perf_counter() - begun_s))
    return rates


def _world_step() -> Callable[[], None]:
    rng = np.random.default_rng(0)
    scenario = Scenario(
        area=Area((40.42, -86.93), (1667.0, 1222.0)),
        launch_enu_m=np.tile([[833.5, 611.0]], (UAVS, 1)),
        collect_mbps=np.full(USERS, 0.02),
        max_accel_mps2=4.5,
    )
    state = WorldState(
        slot=0,
        uav_pos_enu_m=rng.uniform(300, 900, (BATCH, UAVS, 2)),
        uav_vel_enu_mps=np.zeros((BATCH, UAVS, 2)),
        uav_energy_j=np.full((BATCH, UAVS), scenario.battery_j),
        uav_active=np.ones((BATCH, UAVS), dtype=np.bool_),
        user_pos_enu_m=rng.uniform(0, 1200, (BATCH, USERS, 2)),
        user_data_mb=np.zeros((BATCH, USERS)),
        user_aoi_slots=np.ones((BATCH, USERS)),
        user_active=np.ones((BATCH, USERS), dtype=np.bool_),
    )
    action = JointAction(rng.uniform(0, 6.28, (BATCH, UAVS)), np.full((BATCH, UAVS), 18.0))

    def slot() -> None:
        step(scenario, state, action, state.user_pos_enu_m)

    return slot


def _mock_step() -> Callable[[], None]:
    fleet = BatchFleet(BATCH, UAVS)
    commands = np.random.default_rng(0).uniform(-12.0, 12.0, (BATCH, UAVS, 3))
    commands[..., 2] = 0.0

    def slot() -> None:
        fleet.step_slot(commands)

    return slot
