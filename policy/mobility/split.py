"""Which users a policy trains on and which it is judged on."""

from dataclasses import dataclass

import numpy as np

from policy.mobility.traces import TraceError, UserTraces


@dataclass(frozen=True)
class UserSplit:
    """Two sets of users that share nobody, and no copy of anybody."""

    train: UserTraces
    test: UserTraces


def split_users(traces: UserTraces, *, test_share: float = 0.3, seed: int = 0) -> UserSplit:
    """Remove duplicate paths, then draw the test users; each side gets at least one and keeps file order."""
    if not 0.0 < test_share < 1.0:
        raise ValueError(f"test_share must lie between 0 and 1, got {test_share}")
    distinct = traces.without_duplicates()
    if distinct.num_users < 2:
        raise TraceError(f"{traces.source}: one distinct user cannot be split; bring at least two")
    num_test = min(max(round(test_share * distinct.num_users), 1), distinct.num_users - 1)
    order = np.random.default_rng(seed).permutation(distinct.num_users)
    test, train = np.sort(order[:num_test]), np.sort(order[num_test:])
    return UserSplit(train=distinct.select(train.tolist()), test=distinct.select(test.tolist()))
