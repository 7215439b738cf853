"""Whether one method beats another: Wilcoxon's signed-rank test on paired campaigns, exact."""

from collections.abc import Sequence

import numpy as np

from policy.world.arrays import FloatArray, IntArray


def signed_rank_p(one: Sequence[float], other: Sequence[float]) -> float:
    """Two-sided p of "no difference" between paired values (Wilcoxon, Biometrics Bulletin 1(6), 1945).

    Pairs that are equal are left out, as Wilcoxon did; equal differences share their mean rank. Every assignment of
    signs is counted, so nothing is approximated. 1.0 where no pair differs.
    """
    difference = np.asarray(one, dtype=np.float64) - np.asarray(other, dtype=np.float64)
    difference = difference[difference != 0.0]
    doubled = _doubled_ranks(np.abs(difference))
    total = int(doubled.sum())
    ways = np.zeros(total + 1)
    ways[0] = 1.0
    for rank in doubled:
        ways[rank:] = ways[rank:] + ways[: total + 1 - rank]
    plus = int(doubled[difference > 0.0].sum())
    tail = float(np.sum(ways[: min(plus, total - plus) + 1]) / np.sum(ways))
    return min(1.0, 2.0 * tail)


def _doubled_ranks(size: FloatArray) -> IntArray:
    """Twice the mean rank of each, so that ties stay whole numbers."""
    ordered = np.sort(size)
    first, last = np.searchsorted(ordered, size, "left"), np.searchsorted(ordered, size, "right")
    return np.asarray(first + 1 + last, dtype=np.int64)
