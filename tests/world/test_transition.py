"""One slot by hand: who is served, what ages, what is spent; the reward and the four metrics (Eq. 3-8)."""

from dataclasses import replace

import numpy as np
import pytest
from scenarios import HUT, TOWER, make_scenario

from policy.world.energy import propulsion_power_w
from policy.world.metrics import campaign_metrics
from policy.world.reward import reward
from policy.world.scenario import Objective
from policy.world.state import JointAction, WorldState, initial_state
from policy.world.transition import step

NORTH = JointAction(np.asarray([0.0, 0.0]), np.asarray([18.0, 18.0]))
HOVER = JointAction(np.zeros(2), np.zeros(2))
USERS = np.asarray([[800.0, 600.0], [800.0, 850.0], [1500.0, 100.0], [800.0, 1100.0], [100.0, 100.0]])


def test_service_is_judged_at_the_slots_end() -> None:
    scenario = make_scenario()
    state, outcome = step(scenario, initial_state(scenario, USERS), NORTH, USERS)
    # From (800, 600) north by 270 m: the user at the launch point is 270 m away, out of the 226 m radius.
    assert state.uav_pos_enu_m.tolist() == [[800.0, 870.0]] * 2
    assert outcome.served.tolist() == [False, True, False, False, False]
    assert state.user_aoi_slots.tolist() == [2.0, 1.0, 2.0, 2.0, 2.0]
    assert state.user_data_mb == pytest.approx([0.3, 0.0, 0.3, 0.3, 0.3])


def test_users_are_judged_where_they_have_gone() -> None:
    scenario = make_scenario()
    moved = USERS + np.asarray([0.0, -400.0])
    _, outcome = step(scenario, initial_state(scenario, USERS), HOVER, moved)
    assert outcome.served.tolist() == [False, True, False, True, False]


def test_reward_by_hand() -> None:
    scenario = make_scenario()
    before = initial_state(scenario, USERS)
    after, outcome = step(scenario, before, NORTH, USERS)
    # Four users age by one slot and gather 0.3 Mb each: -(4 * 10 + 4 * 0.3) / 5.
    assert reward(scenario, before, after, outcome) == pytest.approx(-(4 * 10.0 + 4 * 0.3) / 5)


def test_bonuses_and_penalties_by_hand() -> None:
    weights = Objective(c_collect=0.0, c_aoi=0.0, c_cover=2.0, c_energy=3.0, penalty=7.0)
    scenario = replace(make_scenario(), objective=weights)
    before = replace(initial_state(scenario, USERS), uav_pos_enu_m=np.asarray([[800.0, 600.0], [800.0, 1190.0]]))
    after, outcome = step(scenario, before, NORTH, USERS)
    spent = 2 * 15.0 * float(propulsion_power_w(np.asarray(18.0))) / scenario.battery_j
    assert outcome.left_area.tolist() == [False, True]
    expected = 2.0 * outcome.served.sum() / 5 - 3.0 * spent - 7.0
    assert reward(scenario, before, after, outcome) == pytest.approx(expected)


def test_a_tower_is_hit_and_a_hut_is_not() -> None:
    scenario = make_scenario(obstacles=(TOWER, HUT))
    east = JointAction(np.full(2, np.pi / 2), np.full(2, 18.0))
    _, outcome = step(scenario, initial_state(scenario, USERS), east, USERS)
    assert outcome.hit_obstacle.all()
    _, outcome = step(scenario, initial_state(scenario, USERS), NORTH, USERS)
    assert not outcome.hit_obstacle.any()


def test_an_empty_battery_ends_service() -> None:
    scenario = make_scenario()
    before = replace(initial_state(scenario, USERS), uav_energy_j=np.asarray([10.0, 10.0]))
    after, outcome = step(scenario, before, HOVER, USERS)
    assert outcome.ran_empty.all()
    assert not outcome.served.any()
    assert not after.uav_active.any()
    later, outcome = step(scenario, after, NORTH, USERS)
    assert outcome.energy_j.tolist() == [0.0, 0.0]
    assert later.uav_pos_enu_m.tolist() == after.uav_pos_enu_m.tolist()


def test_absent_users_neither_age_nor_count() -> None:
    scenario = make_scenario()
    before = replace(initial_state(scenario, USERS), user_active=np.asarray([True, True, False, False, False]))
    after, outcome = step(scenario, before, NORTH, USERS)
    assert after.user_aoi_slots.tolist() == [2.0, 1.0, 1.0, 1.0, 1.0]
    assert reward(scenario, before, after, outcome) == pytest.approx(-(10.0 + 0.3) / 2)


def test_batches_are_many_single_campaigns() -> None:
    scenario = make_scenario()
    single = initial_state(scenario, USERS)
    fields = {name: np.stack([getattr(single, name)] * 3) for name in WorldState.__dataclass_fields__ if name != "slot"}
    headings = np.asarray([[0.0, 1.0], [2.0, 3.0], [4.0, 5.0]])
    batch, outcome = step(
        scenario, WorldState(slot=0, **fields), JointAction(headings, headings * 3.0), fields["user_pos_enu_m"]
    )
    for index in range(3):
        alone, alone_outcome = step(scenario, single, JointAction(headings[index], headings[index] * 3.0), USERS)
        assert batch.uav_pos_enu_m[index] == pytest.approx(alone.uav_pos_enu_m)
        assert outcome.served[index].tolist() == alone_outcome.served.tolist()
        assert outcome.energy_j[index] == pytest.approx(alone_outcome.energy_j)


def test_metrics_by_hand() -> None:
    scenario = make_scenario(num_users=2)
    aoi = np.asarray([[2.0, 1.0], [3.0, 1.0], [1.0, 2.0]])
    data = np.asarray([[0.3, 0.0], [0.6, 0.0], [0.0, 0.3]])
    served = np.asarray([[False, True], [False, True], [True, False]])
    metrics = campaign_metrics(scenario, aoi, data, served, np.asarray([35_964.0, 71_928.0]))
    assert metrics.episodic_aoi == pytest.approx(10.0 / 6.0)
    assert metrics.data_collection_ratio == pytest.approx(1.0 - 0.3 / (3 * 15 * 0.04))
    assert metrics.user_coverage == pytest.approx(0.5)
    assert metrics.energy_ratio == pytest.approx(0.15)
    assert metrics.final_aoi == 1.5
