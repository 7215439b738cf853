import numpy as np
from tests_training_small import SMALL_PLACE

from policy.agents.uniform import UniformAgent
from policy.model.features import USER_FEATURES
from policy.training.collect import Exploring, fly_episode, random_action
from policy.world.airspace import legal_moves
from policy.world.state import initial_state


def test_an_episode_holds_what_was_flown() -> None:
    rng = np.random.default_rng(3)
    scenario, pos_enu_m = SMALL_PLACE(rng)
    episode, score = fly_episode(scenario, pos_enu_m, UniformAgent(), 0.0, rng)
    assert episode.slots == scenario.slots
    assert episode.user.shape == (scenario.slots + 1, scenario.num_users, USER_FEATURES)
    assert score == np.mean(episode.aoi_slots[1:], dtype=np.float64)
    ideal = episode.action * episode.uav_mask[:-1, :, None]  # the paper's motion: v tau, in units of reach
    np.testing.assert_allclose(episode.uav_next[..., :2], ideal, atol=1e-5)
    walked_m = np.diff(pos_enu_m, axis=0)
    np.testing.assert_allclose(episode.user[1:, :, 2:4] * 1.3 * scenario.slot_s, walked_m, atol=1e-3)
    np.testing.assert_array_equal(episode.user[2:, :, 4:6], episode.user[1:-1, :, 2:4])  # the step before


def test_exploration_is_legal() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        scenario, pos_enu_m = SMALL_PLACE(rng)
        state = initial_state(scenario, pos_enu_m[0])
        action = random_action(scenario, state, rng)
        assert np.all(legal_moves(state.uav_pos_enu_m, state.uav_vel_enu_mps, action.vel_enu_mps, scenario))


def test_the_share_decides_who_flies() -> None:
    rng = np.random.default_rng(5)
    scenario, pos_enu_m = SMALL_PLACE(rng)
    state = initial_state(scenario, pos_enu_m[0])

    class Hovers(UniformAgent):
        def decide(self, state):  # type: ignore[no-untyped-def]
            decision = super().decide(state)
            decision.action.speed_mps[:] = 0.0
            return decision

    always, never = Exploring(Hovers(), 1.0, rng), Exploring(Hovers(), 0.0, rng)
    for agent in (always, never):
        agent.reset(scenario, 0)
    assert all(np.all(never.decide(state).action.speed_mps == 0.0) for _ in range(20))
    assert any(np.any(always.decide(state).action.speed_mps > 0.0) for _ in range(20))
