"""Who is stopped, as a restarted server finds it."""

import pytest

from gcs.ports import Event
from gcs.store.store import Store


@pytest.mark.parametrize(
    ("words", "everyone", "ones"),
    [
        ([("stop", None)], True, ()),
        ([("stop", None), ("stop_reset", None)], False, ()),
        ([("stop", 2), ("stop", 5)], False, (2, 5)),
        ([("stop", 2), ("stop_reset", 2)], False, ()),
        ([("stop", None), ("stop_reset", 2)], True, ()),
        ([("stop", 2), ("stop", None), ("stop_reset", None)], False, ()),
    ],
)
def test_a_reset_of_one_takes_no_latch_of_all_off(
    store: Store, words: list[tuple[str, int | None]], everyone: bool, ones: tuple[int, ...]
) -> None:
    for kind, system_id in words:
        store.journal.record(Event(0.0, f"safety.{kind}", "", system_id=system_id))
    assert store.journal.flush(20.0)
    assert (store.checkpoints.stop_latched(), store.checkpoints.stopped_ones()) == (everyone, ones)
