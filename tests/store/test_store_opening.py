"""Opening and migrating."""

import gc
from pathlib import Path

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import text

from gcs.store.engine import StoreError, open_engine
from gcs.store.keys import Role
from gcs.store.migrate import MIGRATIONS, NEWEST
from gcs.store.models import Base
from gcs.store.store import Store, open_store


def test_the_migrations_make_what_the_models_say(store: Store) -> None:
    with store.engine.connect() as connection:
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []


def test_the_newest_revision_is_the_one_that_is_left_alone() -> None:
    """A new migration that NEWEST does not name would never run on a store that was opened before."""
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    assert ScriptDirectory.from_config(config).get_current_head() == NEWEST


def test_a_store_of_an_older_version_is_brought_up(store_url: str) -> None:
    opened = open_store(store_url)
    with opened.engine.begin() as connection:
        config = Config()
        config.set_main_option("script_location", str(MIGRATIONS))
        config.attributes["connection"] = connection
        command.downgrade(config, "-1")
    opened.close()
    again = open_store(store_url)
    with again.engine.connect() as connection:
        assert connection.execute(text("SELECT version_num FROM alembic_version")).scalar() == NEWEST
        assert compare_metadata(MigrationContext.configure(connection), Base.metadata) == []
    again.close()


def test_opening_again_keeps_what_is_there(store_url: str) -> None:
    first = open_store(store_url)
    first.keys.add("ann", Role.OPERATOR)
    first.close()
    second = open_store(store_url)
    assert [key.name for key in second.keys.all()] == ["ann"]
    second.close()


def test_sqlite_writes_ahead(tmp_path: Path) -> None:
    opened = open_store(f"sqlite:///{tmp_path / 'new' / 'folder' / 'a.sqlite3'}")
    with opened.engine.connect() as connection:
        assert connection.execute(text("PRAGMA journal_mode")).scalar() == "wal"
    opened.close()


@pytest.mark.parametrize("url", ["", "nonsense", "sqlite://", "sqlite:///:memory:", "mysqlx://host/name"])
def test_a_url_that_is_none_is_told_in_one_line(url: str) -> None:
    with pytest.raises(StoreError) as caught:
        open_engine(url)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_no_database_is_told_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("this is no database, " * 100)
    with pytest.raises(StoreError, match="cannot be opened") as caught:
        open_store(f"sqlite:///{path}")
    assert "\n" not in str(caught.value)


def test_a_store_of_a_newer_version_is_not_touched(store_url: str) -> None:
    opened = open_store(store_url)
    with opened.engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    opened.close()
    with pytest.raises(StoreError, match="another version"):
        open_store(store_url)
    gc.collect()  # a connection that was left open says so when it is collected, and that is an error here
