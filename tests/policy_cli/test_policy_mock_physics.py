"""A slot flown by the mock's vehicles against the world's own: nearly there, later, and by the same rules."""

from dataclasses import replace

import numpy as np
import pytest

from policy.cli.mock_physics import MockPhysics
from policy.evaluation.rollout import fly
from policy.training.collect import ArrayPlaces, make_episode, random_action
from policy.world.metrics import campaign_metrics
from policy.world.scenario import Area, Scenario
from policy.world.state import JointAction, WorldState, initial_state
from policy.world.transition import step

PLACES_M = np.array([[1000.0, 1000.0], [1260.0, 1000.0], [400.0, 400.0]])
SCENARIO = Scenario(
    Area((0.0, 0.0), (2000.0, 2000.0)), np.array([[900.0, 1000.0], [1000.0, 900.0]]), np.full(3, 0.02), slots=4
)
EAST = JointAction(np.full(2, np.pi / 2.0), np.array([18.0, 0.0]))


def test_it_flies_the_way_that_the_world_plans_a_little_later() -> None:
    physics, state = MockPhysics(), initial_state(SCENARIO, PLACES_M)
    flown, outcome = physics(SCENARIO, state, EAST, PLACES_M)
    ideal, expected = step(SCENARIO.with_accel(4.5), state, EAST, PLACES_M)
    assert np.linalg.norm(flown.uav_pos_enu_m - ideal.uav_pos_enu_m, axis=1).max() < 15.0
    assert flown.uav_pos_enu_m[0, 0] < 900.0 + 18.0 * 15.0
    np.testing.assert_allclose(flown.uav_vel_enu_mps, [[18.0, 0.0], [0.0, 0.0]], atol=0.3)
    np.testing.assert_allclose(outcome.energy_j, expected.energy_j, rtol=0.1)
    assert outcome.served.tolist() == expected.served.tolist()
    assert flown.user_aoi_slots.tolist() == ideal.user_aoi_slots.tolist()
    assert flown.slot == 1


@pytest.mark.parametrize("at_the_end", [False, True])
def test_turns_are_flown_as_the_world_plans_them(at_the_end: bool) -> None:
    place, start = SCENARIO.with_accel(4.5), initial_state(SCENARIO, PLACES_M)
    east = JointAction(EAST.heading_rad, np.full(2, 18.0))
    north = JointAction(np.zeros(2), np.full(2, 18.0))
    if at_the_end:
        north = replace(east, end_heading_rad=north.heading_rad, end_speed_mps=north.speed_mps)
    off_m = {}
    for limited in (True, False):
        physics, motion = MockPhysics(), place if limited else SCENARIO
        one, _ = physics(motion, start, east, PLACES_M)
        two, _ = physics(motion, one, north, PLACES_M)
        expected, _ = step(place, one, north, PLACES_M)
        off_m[limited] = float(np.linalg.norm(two.uav_pos_enu_m - expected.uav_pos_enu_m, axis=1).max())
        if limited:
            np.testing.assert_allclose(two.uav_vel_enu_mps, expected.uav_vel_enu_mps, atol=2.5)
    assert off_m[True] < 10.0 < off_m[False], "a velocity held is turned into straight, and falls behind"


def test_velocity_is_carried_into_the_next_slot_and_a_new_campaign_begins_at_rest() -> None:
    physics, start = MockPhysics(), initial_state(SCENARIO, PLACES_M)
    one, _ = physics(SCENARIO, start, EAST, PLACES_M)
    back = JointAction(np.full(2, 1.5 * np.pi), np.array([18.0, 0.0]))
    two, _ = physics(SCENARIO, one, back, PLACES_M)
    assert one.uav_pos_enu_m[0, 0] - two.uav_pos_enu_m[0, 0] < 0.85 * 270.0  # it had to turn round first
    again, _ = physics(SCENARIO, start, EAST, PLACES_M)
    np.testing.assert_array_equal(again.uav_pos_enu_m, one.uav_pos_enu_m)


def test_leaving_the_area_and_an_empty_battery_are_noticed() -> None:
    edge = replace(SCENARIO, launch_enu_m=np.array([[1990.0, 1000.0], [1000.0, 1000.0]]), battery_j=1000.0)
    after, outcome = MockPhysics()(edge, initial_state(edge, PLACES_M), EAST, PLACES_M)
    assert outcome.left_area.tolist() == [True, False]
    assert outcome.ran_empty.all()
    assert not after.uav_active.any()
    assert not outcome.served.any()
    assert not after.uav_energy_j.any()


@pytest.mark.parametrize("seed", [0, 1])
def test_an_episode_can_be_learned_from(seed: int) -> None:
    class Wanderer:
        name = "wanderer"

        def reset(self, scenario: Scenario, seed: int) -> None:
            self.scenario, self.rng = scenario, np.random.default_rng(seed)

        def decide(self, state: WorldState):  # type: ignore[no-untyped-def]
            return type("D", (), {"action": random_action(self.scenario, state, self.rng)})()

    accelerated = SCENARIO.with_accel(4.5)
    record = fly(
        accelerated, ArrayPlaces(np.repeat(PLACES_M[None], 5, axis=0)), Wanderer(), seed, physics=MockPhysics()
    )
    episode = make_episode(record)
    assert episode.slots == 4
    assert np.isfinite(episode.uav_next).all()
    assert np.all(episode.uav_next[..., 2] > 0.0)
    again = campaign_metrics(
        accelerated,
        record.aoi_slots,
        np.stack([state.user_data_mb for state in record.states[1:]]),
        record.served,
        record.energy_used_j,
    )
    assert record.metrics == again
