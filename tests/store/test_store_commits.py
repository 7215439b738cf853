"""The number that says whether what was read is still what is written."""

from sqlalchemy import text

from gcs.ports import Event
from gcs.store.campaigns import Campaigns
from gcs.store.keys import Role
from gcs.store.store import Store
from policy.mission_file import load_mission


def test_it_has_grown_when_a_write_returns_and_reading_leaves_it(store: Store) -> None:
    before = store.commits.count
    store.campaigns.newest()
    assert store.commits.count == before
    store.campaigns.create(load_mission("demo"), "ann")
    assert store.commits.count == before + 1
    store.keys.add("bob", Role.VIEWER)
    assert store.commits.count == before + 2
    store.journal.record(Event(1.0, "plan.late", "late"))
    assert store.journal.flush(5.0)
    assert store.commits.count == before + 3


def test_it_grows_after_the_write_can_be_read_not_before(store: Store, monkeypatch: object) -> None:
    """Who reads the old rows under the new number would keep them."""
    before, during = store.commits.count, []
    with store.engine.connect() as connection:
        connection.execute(text("DELETE FROM api_keys"))
        during.append(store.commits.count)
        connection.commit()
        during.append(store.commits.count)  # the connection has not come back
    assert during == [before, before]
    assert store.commits.count == before + 1


def test_what_is_rolled_back_counts_for_nothing(store: Store) -> None:
    before = store.commits.count
    with store.engine.connect() as connection:
        connection.execute(text("DELETE FROM api_keys"))
    assert Campaigns(store.engine).newest() == []
    assert store.commits.count == before
