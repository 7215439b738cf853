"""Train and test share nobody and no copy of anybody."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policy.mobility.split import split_users
from policy.mobility.traces import TraceError, UserTraces


def users_at(eastings_m: list[int]) -> UserTraces:
    """Users who stand at the given places: equal places are copies."""
    pos_enu_m = np.array([[[float(east_m), 0.0] for east_m in eastings_m]] * 2)
    return UserTraces(tuple(f"u{index}" for index in range(len(eastings_m))), pos_enu_m, 15.0, "by hand")


@given(
    eastings_m=st.lists(st.integers(0, 12), min_size=2, max_size=40).filter(lambda places: len(set(places)) > 1),
    seed=st.integers(0, 2**32),
    test_share=st.floats(0.01, 0.99),
)
def test_sides_are_disjoint_complete_and_not_empty(eastings_m: list[int], seed: int, test_share: float) -> None:
    split = split_users(users_at(eastings_m), test_share=test_share, seed=seed)
    train, test = (set(side.pos_enu_m[0, :, 0].tolist()) for side in (split.train, split.test))
    assert train
    assert test
    assert not train & test
    assert train | test == {float(east_m) for east_m in eastings_m}
    assert split.train.num_users + split.test.num_users == len(set(eastings_m))


def test_the_seed_decides() -> None:
    traces = users_at(list(range(30)))
    first, again, other = (split_users(traces, seed=seed).test.user_ids for seed in (1, 1, 2))
    assert first == again
    assert first != other
    assert len(first) == 9


def test_refuses_a_single_distinct_user() -> None:
    with pytest.raises(TraceError, match="cannot be split"):
        split_users(users_at([3, 3]))


@pytest.mark.traces
def test_no_copy_of_a_purdue_user_is_on_both_sides(real_traces: dict[str, UserTraces]) -> None:
    split = split_users(real_traces["purdue_59.csv"], seed=5)
    paths = [
        {side.pos_enu_m[:, user].tobytes() for user in range(side.num_users)} for side in (split.train, split.test)
    ]
    assert not paths[0] & paths[1]
    assert len(paths[0]) + len(paths[1]) == 52
