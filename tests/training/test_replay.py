import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests_training_small import made_episode

from policy.model.features import USER_FEATURES
from policy.training.replay import Replay, discounted, make_batch


def test_discounted_ages_by_hand() -> None:
    """(1 - 0.5) (1 * 4 + 0.5 * 8) = 4."""
    np.testing.assert_allclose(discounted(np.array([[4.0], [8.0]], dtype=np.float32), 0.5), [4.0])


@given(st.floats(0.1, 0.99), st.floats(1.0, 100.0), st.integers(1, 40))
def test_constant_ages_and_what_follows_them_weigh_one(gamma: float, aoi: float, steps: int) -> None:
    """The sum over n slots and gamma^n of the same again is the age itself: Eq. 16's target has its fixed point."""
    ages = np.full((steps, 1), aoi, dtype=np.float32)
    assert discounted(ages, gamma)[0] + gamma**steps * aoi == pytest.approx(aoi, rel=1e-4)


def test_a_batch_pads_the_smaller_campaign_with_the_absent() -> None:
    episodes = [made_episode(4, 1, 2), made_episode(4, 2, 3)]
    batch = make_batch(episodes, [0, 1], n_step=2, gamma=0.5)
    assert batch.now.user.shape == (2, 3, USER_FEATURES)
    np.testing.assert_array_equal(batch.now.user_mask, [[1, 1, 0], [1, 1, 1]])
    np.testing.assert_array_equal(batch.now.uav_mask, [[1, 0], [1, 1]])
    np.testing.assert_array_equal(batch.now.uav[1], episodes[1].uav[1])
    np.testing.assert_array_equal(batch.user_next[1], episodes[1].user[2][:, [2, 3, 10, 12]])
    np.testing.assert_array_equal(batch.ahead.user[1], episodes[1].user[3])
    np.testing.assert_allclose(batch.cost_slots[1], 0.5 * (np.array([20, 21, 22]) + 0.5 * np.array([30, 31, 32])))


def test_near_the_end_the_value_takes_over_sooner() -> None:
    episode = made_episode(4, 1, 1)
    batch = make_batch([episode, episode], [0, 3], n_step=3, gamma=0.5)
    np.testing.assert_allclose(batch.ahead_weight, [0.5**3, 0.5])
    np.testing.assert_allclose(batch.cost_slots[:, 0], [0.5 * (10 + 10 + 7.5), 0.5 * 40])
    np.testing.assert_array_equal(batch.ahead.uav[1], episode.uav[4])


def test_the_oldest_episode_makes_room() -> None:
    replay = Replay(2)
    for users in (1, 2, 3):
        replay.add(made_episode(2, 1, users))
    assert [episode.user.shape[1] for episode in replay.episodes] == [2, 3]


def test_the_same_draw_gives_the_same_batch() -> None:
    replay = Replay(3, [made_episode(5, 1, 2, seed) for seed in range(3)])
    first, again, other = (replay.sample(np.random.default_rng(s), 16, 3, 0.9) for s in (1, 1, 2))
    np.testing.assert_array_equal(first.now.user, again.now.user)
    assert not np.array_equal(first.now.user, other.now.user)
