"""The newest events in memory."""

from hypothesis import given
from hypothesis import strategies as st

from gcs.ports import Event
from gcs.store.event_tail import EventTail


@given(st.integers(1, 20), st.integers(0, 60), st.integers(0, 70), st.integers(1, 30))
def test_a_reader_gets_the_oldest_that_are_left_after_its_last(capacity: int, told: int, seen: int, limit: int) -> None:
    tail = EventTail(capacity)
    for index in range(told):
        tail.append(Event(float(index), "a", str(index)))
    kept = [n for n in range(1, told + 1) if n > told - capacity]
    assert [n.sequence for n in tail.since(seen, limit)] == [n for n in kept if n > seen][:limit]
    assert tail.last_sequence == told


def test_counts_and_the_newest_verdict_of_each_vehicle() -> None:
    tail = EventTail(1)
    for system_id, words in ((1, "no"), (2, "yes"), (1, "yes")):
        tail.append(Event(0.0, "command.verdict", words, system_id=system_id))
    assert tail.counts() == {("command.verdict", "info"): 3}
    assert {system_id: event.message for system_id, event in tail.verdicts().items()} == {1: "yes", 2: "yes"}
