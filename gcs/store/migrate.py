"""Brings a database to this version's tables, at start.

A database that stands at :data:`NEWEST` already is left alone and costs no import of Alembic: a server that starts
again after a crash has drones in the air.
"""

from pathlib import Path

from sqlalchemy import Connection, Engine, inspect, text
from sqlalchemy.exc import SQLAlchemyError

from gcs.store.engine import StoreError

MIGRATIONS = Path(__file__).parent / "migrations"
NEWEST = "0004"  # the newest file in migrations/versions


def upgrade(engine: Engine) -> None:
    """Run what is missing. Alembic's steps hold one transaction each."""
    try:
        with engine.connect() as connection:
            if not _is_newest(connection):
                _run_missing(connection, _shown(engine))
            connection.commit()
    except SQLAlchemyError as error:
        raise StoreError(f"store {_shown(engine)} cannot be opened: {_first_line(error)}") from None


def _is_newest(connection: Connection) -> bool:
    """Alembic's own table has exactly the newest revision."""
    if not inspect(connection).has_table("alembic_version"):
        return False
    return list(connection.execute(text("SELECT version_num FROM alembic_version")).scalars()) == [NEWEST]


def _run_missing(connection: Connection, shown: str) -> None:
    from alembic import command  # noqa: PLC0415 - see the head of this file
    from alembic.config import Config  # noqa: PLC0415
    from alembic.util import CommandError  # noqa: PLC0415

    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
    config.attributes["connection"] = connection
    try:
        command.upgrade(config, "head")
    except CommandError as error:
        raise StoreError(f"store {shown} is from another version of gcs: {error}") from None


def _shown(engine: Engine) -> str:
    """The URL without its password."""
    return engine.url.render_as_string(hide_password=True)


def _first_line(error: SQLAlchemyError) -> str:
    """The driver's words without SQLAlchemy's background link."""
    return str(error).splitlines()[0]
