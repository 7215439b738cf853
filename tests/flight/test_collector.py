"""What is loaded is left alone by the collector; what comes after is still freed."""

import gc
import weakref
from collections.abc import Iterator

import pytest

from gcs.collector import THRESHOLDS, leave_what_is_loaded


class Node:
    def __init__(self) -> None:
        self.own = self


@pytest.fixture(autouse=True)
def collector() -> Iterator[None]:
    before = gc.get_threshold()
    yield
    gc.unfreeze()
    gc.set_threshold(*before)


def test_what_is_loaded_is_not_looked_at_again() -> None:
    loaded = [Node() for _ in range(1000)]
    leave_what_is_loaded()
    assert gc.get_freeze_count() > len(loaded)
    looked_at = gc.get_objects()
    assert not any(one is loaded for one in looked_at)
    assert gc.get_threshold() == THRESHOLDS
    assert gc.isenabled()


def test_cycles_made_later_are_freed() -> None:
    leave_what_is_loaded()
    seen = weakref.ref(Node())
    gc.collect()
    assert seen() is None
