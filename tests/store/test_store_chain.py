"""The audit log is a chain: any change of what was written is found."""

import pytest
from sqlalchemy import text

from gcs.ports import Event
from gcs.store.chain import GENESIS, verify_chain
from gcs.store.store import Store

WAIT_S = 20.0


def write(store: Store, count: int) -> None:
    for i in range(count):
        store.journal.record(Event(0.1 * i, "plan.late", f"ä {i}", data={"x": 1.0 / 3.0, "nan": float("nan")}))
    assert store.journal.flush(WAIT_S)


def test_an_empty_log_is_whole(store: Store) -> None:
    assert verify_chain(store.engine).head == GENESIS


def test_a_log_written_in_several_transactions_is_one_chain(store: Store) -> None:
    write(store, 3)
    first = verify_chain(store.engine)
    write(store, 4)
    report = verify_chain(store.engine, first.head)
    assert (first.events, report.events, report.broken_id, report.head_seen) == (3, 7, None, True)


@pytest.mark.parametrize(
    ("change", "broken"),
    [
        ("UPDATE events SET message = 'nothing' WHERE id = 3", 3),
        ("UPDATE events SET actor = 'ann' WHERE id = 3", 3),
        ("UPDATE events SET digest = NULL WHERE id = 3", 3),
        ("DELETE FROM events WHERE id = 3", 4),
    ],
)
def test_a_change_is_found(store: Store, change: str, broken: int) -> None:
    write(store, 5)
    with store.engine.begin() as connection:
        connection.execute(text(change))
    assert verify_chain(store.engine).broken_id == broken


def test_an_end_that_was_cut_off_is_found_by_a_digest_noted_before(store: Store) -> None:
    write(store, 5)
    head = verify_chain(store.engine).head
    with store.engine.begin() as connection:
        connection.execute(text("DELETE FROM events WHERE id > 3"))
    report = verify_chain(store.engine, head)
    assert (report.broken_id, report.head_seen) == (None, False)
