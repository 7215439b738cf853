"""Walkers: the seed decides all, nobody leaves the area or enters a building."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from policy.mobility.ground import Ground
from policy.mobility.presets import WALKER_PRESETS
from policy.mobility.traces import UserTraces
from policy.mobility.walkers import Pareto, generate_walkers

SIZE_M = (600.0, 400.0)
HOUSES = (
    ((100.0, 100.0), (300.0, 100.0), (300.0, 300.0), (100.0, 300.0)),
    ((400.0, 50.0), (550.0, 60.0), (480.0, 350.0)),
)


def walkers(seed: int, preset: str = "campus-dense", num_users: int = 20) -> UserTraces:
    return generate_walkers(num_users, 61, 15.0, SIZE_M, seed, params=WALKER_PRESETS[preset], obstacles=HOUSES)


def test_the_seed_decides() -> None:
    np.testing.assert_array_equal(walkers(3).pos_enu_m, walkers(3).pos_enu_m)
    assert not np.array_equal(walkers(3).pos_enu_m, walkers(4).pos_enu_m)
    assert walkers(3).user_ids[:2] == ("w0", "w1")


@given(seed=st.integers(0, 2**40), preset=st.sampled_from(sorted(WALKER_PRESETS)))
@settings(max_examples=25, deadline=None)
def test_everybody_stays_on_free_ground(seed: int, preset: str) -> None:
    traces = walkers(seed, preset)
    assert traces.pos_enu_m.shape == (61, 20, 2)
    assert np.all(Ground(SIZE_M, HOUSES).free(traces.pos_enu_m))


@pytest.mark.parametrize("preset", sorted(WALKER_PRESETS))
def test_nobody_is_faster_than_a_bus(preset: str) -> None:
    traces = generate_walkers(60, 121, 15.0, (3000.0, 3000.0), 1, params=WALKER_PRESETS[preset])
    interval = WALKER_PRESETS[preset].receiver.interval_samples
    step_m = np.linalg.norm(np.diff(traces.pos_enu_m[::interval], axis=0), axis=-1)
    assert 0.0 < np.quantile(step_m, 0.999) / (15.0 * interval) < 20.0


def test_refuses_ground_without_room_and_empty_requests() -> None:
    everything = ((-1.0, -1.0), (601.0, -1.0), (601.0, 401.0), (-1.0, 401.0))
    with pytest.raises(ValueError, match="no room"):
        generate_walkers(2, 3, 15.0, SIZE_M, 0, obstacles=(everything,))
    with pytest.raises(ValueError, match="at least one user"):
        generate_walkers(0, 3, 15.0, SIZE_M, 0)


def test_pareto_draws_follow_the_truncated_law() -> None:
    """Against the distribution function: F(x) = (l^-a - x^-a) / (l^-a - h^-a)."""
    law, rng = Pareto(2.0, 50.0, 1.5), np.random.default_rng(0)
    draws = np.array([law.draw(rng) for _ in range(20_000)])
    assert draws.min() >= 2.0
    assert draws.max() <= 50.0
    for place in (3.0, 6.0, 20.0):
        expected = (2.0**-1.5 - place**-1.5) / (2.0**-1.5 - 50.0**-1.5)
        assert abs(float(np.mean(draws <= place)) - expected) < 0.01
