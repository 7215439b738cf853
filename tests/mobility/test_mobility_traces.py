"""UserTraces holds its shape, and copies of a path count once."""

import numpy as np
import pytest

from policy.mobility.traces import TraceError, UserTraces


def three_users() -> UserTraces:
    """Users a and c walk the same path."""
    path = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 4.0]])
    other = path + np.array([0.0, 0.5])
    return UserTraces(("a", "b", "c"), np.stack([path, other, path], axis=1), 15.0, "by hand")


def test_selects_users_in_the_order_asked() -> None:
    chosen = three_users().select([2, 1])
    assert chosen.user_ids == ("c", "b")
    np.testing.assert_array_equal(chosen.pos_enu_m[0], [[0.0, 0.0], [0.0, 0.5]])


def test_keeps_the_first_of_copies() -> None:
    assert three_users().without_duplicates().user_ids == ("a", "b")


def test_negative_zero_is_the_same_place() -> None:
    traces = UserTraces(("a", "b"), np.array([[[0.0, 1.0], [-0.0, 1.0]]]), 15.0, "by hand")
    assert traces.without_duplicates().num_users == 1


def test_truncates_and_refuses_more_than_there_is() -> None:
    assert three_users().truncated(2).num_samples == 2
    with pytest.raises(TraceError, match="4 samples asked, 3 there"):
        three_users().truncated(4)


@pytest.mark.parametrize(
    ("ids", "pos_enu_m", "complaint"),
    [
        (("a",), np.zeros((3, 2, 2)), "must be"),
        (("a", "a"), np.zeros((3, 2, 2)), "distinct"),
        (("a",), np.full((1, 1, 2), np.nan), "finite"),
    ],
)
def test_refuses_what_no_reader_expects(ids: tuple[str, ...], pos_enu_m: np.ndarray, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        UserTraces(ids, pos_enu_m, 15.0, "by hand")


@pytest.mark.traces
def test_purdue_holds_52_distinct_users(real_traces: dict[str, UserTraces]) -> None:
    assert real_traces["purdue_59.csv"].num_users == 59
    assert real_traces["purdue_59.csv"].without_duplicates().num_users == 52
