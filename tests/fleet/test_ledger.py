"""The books of a flown campaign equal the world's own rollout when the vehicles fly the world's motion."""

import numpy as np
import pytest

from gcs.fleet.energy_meter import EnergyMeter
from gcs.fleet.ledger import CampaignLedger, FleetState
from policy.agents.base import Decision
from policy.evaluation.rollout import fly
from policy.world.arrays import FloatArray
from policy.world.energy import propulsion_power_w
from policy.world.scenario import Area, Scenario
from policy.world.state import JointAction, WorldState

SLOTS, USERS = 5, 12
SCENARIO = Scenario(
    Area((40.0, -86.0), (1200.0, 900.0)), np.full((2, 2), 450.0), np.linspace(0.01, 0.03, USERS), slots=SLOTS
)


class Walk:
    """Users on a fixed random walk."""

    num_users = USERS

    def __init__(self) -> None:
        rng = np.random.default_rng(4)
        self.path = 500.0 + np.cumsum(rng.normal(0.0, 40.0, (SLOTS + 1, USERS, 2)), axis=0)

    def positions(self, sample: int) -> FloatArray:
        return np.asarray(self.path[sample], dtype=np.float64)


class Circle:
    name = "circle"

    def reset(self, scenario: Scenario, seed: int) -> None: ...

    def decide(self, state: WorldState) -> Decision:
        return Decision(JointAction(np.array([1.3 * state.slot, 4.0]), np.array([12.0, 6.0])))


def test_books_equal_the_worlds_rollout() -> None:
    truth = fly(SCENARIO, Walk(), Circle())
    used = np.zeros(2)
    start = FleetState(truth.states[0].uav_pos_enu_m, np.zeros((2, 2)), used, np.ones(2, dtype=bool))
    ledger = CampaignLedger(SCENARIO, Walk(), tuple(f"u{i}" for i in range(USERS)), (1, 2), start)
    fleet = start
    for before, after, outcome in zip(truth.states[:-1], truth.states[1:], truth.outcomes, strict=True):
        seen = ledger.state(fleet)
        np.testing.assert_allclose(seen.user_aoi_slots, before.user_aoi_slots)
        np.testing.assert_allclose(seen.user_pos_enu_m, before.user_pos_enu_m)
        used = used + outcome.energy_j
        fleet = FleetState(after.uav_pos_enu_m, after.uav_vel_enu_mps, used, np.ones(2, dtype=bool))
        np.testing.assert_array_equal(ledger.close_slot(fleet), outcome.served)
    record = ledger.record(75.0, fleet, 3.0)
    assert record.metrics == truth.metrics
    assert record.slot == SLOTS
    assert [user.served for user in record.users] == truth.outcomes[-1].served.tolist()
    assert record.uavs[0].energy_j == pytest.approx(truth.energy_used_j[0])


def test_a_drone_that_left_serves_nobody() -> None:
    place = np.array(Walk().positions(1)[:2])
    gone = FleetState(place, np.zeros((2, 2)), np.zeros(2), np.zeros(2, dtype=bool))
    ledger = CampaignLedger(SCENARIO, Walk(), tuple(f"u{i}" for i in range(USERS)), (1, 2), gone)
    assert not ledger.close_slot(gone).any()


def test_energy_is_integrated_over_true_times_and_only_in_the_air() -> None:
    meter = EnergyMeter(2)
    for time_s in (0.0, 0.1, 0.3, 1.0, 2.0):
        meter.tick(time_s, [10.0, 10.0], [True, False])
    expected = 2.0 * float(propulsion_power_w(np.array(10.0)))
    assert meter.used_j() == pytest.approx([expected, 0.0])
    meter.tick(3.0, [10.0, 10.0], [True, False])
    assert meter.used_j() == pytest.approx([1.5 * expected, 0.0])
