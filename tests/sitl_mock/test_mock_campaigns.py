"""The compiled campaign against the world's own words."""

from __future__ import annotations

import numpy as np
import pytest

from policy.world.scenario import Area, Scenario
from policy.world.state import WorldState
from policy.world.transition import serve
from sitl_mock.campaigns import BatchCampaigns

CAMPAIGNS, UAVS, USERS, SLOTS = 5, 2, 17, 12


def _scenario() -> Scenario:
    return Scenario(
        area=Area((40.42, -86.93), (1667.0, 1222.0)),
        launch_enu_m=np.array([[800.0, 600.0], [820.0, 600.0]]),
        collect_mbps=np.linspace(0.01, 0.03, USERS),
    )


def _campaigns(seed: int = 0) -> tuple[BatchCampaigns, Scenario, np.ndarray]:
    users_m = np.random.default_rng(seed).uniform(300, 1100, (SLOTS + 1, USERS, 2))
    scenario = _scenario()
    return BatchCampaigns(scenario, users_m, CAMPAIGNS), scenario, users_m


def test_data_and_age_are_the_worlds() -> None:
    batch, scenario, users_m = _campaigns()
    rng = np.random.default_rng(1)
    data, aoi = batch.data_mb.copy(), batch.aoi_slots.copy()
    some = 0
    for slot in range(SLOTS):
        batch.step(rng.uniform(-12, 12, (CAMPAIGNS, UAVS, 2)))
        state = WorldState(
            slot=slot,
            uav_pos_enu_m=batch.uav_pos_enu_m,
            uav_vel_enu_mps=batch.uav_vel_enu_mps,
            uav_energy_j=batch.uav_energy_j,
            uav_active=np.ones((CAMPAIGNS, UAVS), dtype=np.bool_),
            user_pos_enu_m=np.broadcast_to(users_m[slot], (CAMPAIGNS, USERS, 2)),
            user_data_mb=data,
            user_aoi_slots=aoi,
            user_active=np.ones((CAMPAIGNS, USERS), dtype=np.bool_),
        )
        next_users = np.broadcast_to(users_m[slot + 1], (CAMPAIGNS, USERS, 2))
        (data, aoi), served = serve(scenario, state, batch.uav_pos_enu_m, state.uav_active, next_users)
        np.testing.assert_array_equal(batch.served, served)
        np.testing.assert_allclose(batch.data_mb, data, atol=1e-12)
        np.testing.assert_array_equal(batch.aoi_slots, aoi)
        some += int(served.sum())
    assert 0 < some < SLOTS * CAMPAIGNS * USERS


def test_east_is_east_and_energy_is_spent() -> None:
    batch, scenario, _ = _campaigns()
    batch.step(np.broadcast_to([10.0, 0.0], (CAMPAIGNS, UAVS, 2)))
    moved = batch.uav_pos_enu_m - scenario.launch_enu_m
    assert moved[..., 0] == pytest.approx(138.0, abs=6.0)  # 15 s at 10 m/s less the start
    assert moved[..., 1] == pytest.approx(0.0, abs=1e-9)
    assert batch.uav_energy_j == pytest.approx(scenario.battery_j - 15 * 130.0, abs=800.0)


def test_an_empty_uav_serves_nobody() -> None:
    batch, _, _ = _campaigns()
    batch._fleet._fleet.used_j[:] = 1e9
    batch.step(np.zeros((CAMPAIGNS, UAVS, 2)))
    assert not batch.served.any()


def test_the_trace_ends() -> None:
    batch, _, _ = _campaigns()
    for _ in range(batch.slots):
        batch.step(np.zeros((CAMPAIGNS, UAVS, 2)))
    with pytest.raises(IndexError):
        batch.step(np.zeros((CAMPAIGNS, UAVS, 2)))
    batch.reset()
    assert batch.slot == 0
    assert (batch.aoi_slots == 1.0).all()
