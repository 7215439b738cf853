"""Nobody reads a place before its slot is reached."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from policy.mobility.feed import FutureAccessError, TraceFeed
from policy.mobility.traces import UserTraces


def feed_of(num_samples: int) -> TraceFeed:
    """One user who is at (t, t) at sample t."""
    line = np.repeat(np.arange(num_samples, dtype=np.float64), 2).reshape(num_samples, 1, 2)
    return TraceFeed(UserTraces(("a",), line, 15.0, "line"))


@given(reached=st.integers(0, 9), asked=st.integers(0, 9))
def test_shows_exactly_the_samples_up_to_the_present_slot(reached: int, asked: int) -> None:
    feed = feed_of(10)
    feed.reach(reached)
    if asked > reached:
        with pytest.raises(FutureAccessError):
            feed.positions(asked)
    else:
        np.testing.assert_array_equal(feed.positions(asked), [[asked, asked]])


def test_a_reader_cannot_change_the_record() -> None:
    feed = feed_of(2)
    feed.positions(0)[:] = 99.0
    np.testing.assert_array_equal(feed.positions(0), [[0.0, 0.0]])


def test_time_never_runs_backwards_nor_past_the_record() -> None:
    feed = feed_of(3)
    feed.reach(2)
    feed.reach(1)
    assert feed.latest == 2
    with pytest.raises(IndexError, match="the last sample is 2"):
        feed.reach(3)


def test_negative_samples_do_not_wrap_round_to_the_future() -> None:
    with pytest.raises(IndexError, match="count from 0"):
        feed_of(3).positions(-1)


def test_the_world_takes_one_step_at_a_time_and_readers_follow() -> None:
    feed = feed_of(4)
    places = feed.as_places()
    np.testing.assert_array_equal(places.positions(0), [[0.0, 0.0]])
    with pytest.raises(FutureAccessError):
        places.positions(2)
    np.testing.assert_array_equal(places.positions(1), [[1.0, 1.0]])
    assert feed.latest == 1
