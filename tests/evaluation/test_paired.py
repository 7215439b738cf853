"""Wilcoxon's test against his tables and against every assignment of signs."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policy.evaluation.paired import signed_rank_p


@pytest.mark.parametrize(("count", "critical"), [(6, 0), (8, 3), (10, 8), (12, 13), (15, 25), (20, 52)])
def test_critical_values_of_the_printed_table(count: int, critical: int) -> None:
    """Two-sided 5 %: the largest rank sum that is still significant (e.g. Siegel 1956, Table G)."""
    ranks = np.arange(1, count + 1)

    def p_of(rank_sum: int) -> float:
        plus, left = np.zeros(count, dtype=bool), rank_sum
        for rank in ranks[::-1]:
            if rank <= left:
                plus[rank - 1], left = True, left - rank
        return signed_rank_p(np.where(plus, 1.0, -1.0) * ranks, np.zeros(count))

    assert p_of(critical) <= 0.05
    assert p_of(critical + 1) > 0.05


@given(st.lists(st.integers(-4, 4), min_size=1, max_size=8))
def test_ties_and_zeros_against_all_signs(differences: list[int]) -> None:
    kept = np.array([d for d in differences if d], dtype=float)
    if not kept.size:
        assert signed_rank_p(differences, [0.0] * len(differences)) == 1.0
        return
    ranks = np.array([np.mean(np.flatnonzero(np.sort(np.abs(kept)) == abs(d)) + 1.0) for d in kept])
    sums = [
        sum(r for r, s in zip(ranks, signs, strict=True) if s) for signs in itertools.product((0, 1), repeat=kept.size)
    ]
    seen = float(ranks[kept > 0].sum())
    tail = np.mean(np.asarray(sums) <= min(seen, ranks.sum() - seen) + 1e-9)
    assert signed_rank_p(differences, [0.0] * len(differences)) == pytest.approx(min(1.0, 2.0 * tail))


def test_it_does_not_matter_who_is_named_first() -> None:
    rng = np.random.default_rng(0)
    one, other = rng.normal(size=12), rng.normal(0.5, 1.0, size=12)
    assert signed_rank_p(one, other) == signed_rank_p(other, one)
