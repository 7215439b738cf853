"""Events that are held until the store has them: told in order, and in any case after a while."""

from gcs.ports import Event
from gcs.store.event_tail import PATIENCE_S, EventTail


def event(name: str) -> Event:
    return Event(0.0, name, name)


def kinds(tail: EventTail) -> list[str]:
    return [numbered.event.kind for numbered in tail.since(0)]


def test_nothing_is_told_before_the_store_has_it() -> None:
    tail = EventTail(monotonic_s=lambda: 0.0)
    tickets = [tail.hold(event(name)) for name in "abc"]
    assert (kinds(tail), tail.last_sequence, tail.counts()) == ([], 0, {})
    tail.release(tickets[1])
    assert kinds(tail) == ["a", "b"]
    tail.append(event("urgent"))
    assert kinds(tail) == ["a", "b", "c", "urgent"], "in the order in which things happened"


def test_a_stalled_store_does_not_blind_who_watches() -> None:
    now_s = [0.0]
    tail = EventTail(monotonic_s=lambda: now_s[0])
    tail.hold(event("a"))
    now_s[0] = 0.5 * PATIENCE_S
    tail.hold(event("b"))
    assert kinds(tail) == []
    now_s[0] = PATIENCE_S
    assert kinds(tail) == ["a"]
    tail.release()
    assert kinds(tail) == ["a", "b"]
