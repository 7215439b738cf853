"""The beam's choice of the least ranks, against NumPy's stable sort."""

import numpy as np
import pytest

from policy.search.kernel import _best

GENERATOR = np.random.default_rng(5)


@pytest.mark.parametrize("count", [1, 84, 476, 600])
@pytest.mark.parametrize(
    "rank",
    [
        GENERATOR.normal(30.0, 4.0, 477),
        GENERATOR.integers(0, 9, 477).astype(float),
        np.where(GENERATOR.random(477) < 0.6, np.inf, GENERATOR.normal(30.0, 4.0, 477)),
        np.where(np.arange(477) == 9, 1e12, GENERATOR.normal(30.0, 4.0, 477)),
        np.where(np.arange(477) % 2 == 0, np.nan, GENERATOR.normal(30.0, 4.0, 477)),
        np.full(477, 7.0),
        np.full(477, np.inf),
    ],
    ids=["spread", "ties", "illegal", "far-off", "not-a-number", "all-equal", "none"],
)
def test_the_least_ranks_come_in_order_and_equal_ones_by_index(rank: np.ndarray, count: int) -> None:
    by_rank = np.argsort(rank, kind="stable")
    np.testing.assert_array_equal(_best(rank, count), by_rank[np.isfinite(rank[by_rank])][:count])
