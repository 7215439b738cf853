"""Brings a database to this version's tables, at start."""

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy import Engine
from sqlalchemy.exc import SQLAlchemyError

from gcs.store.engine import StoreError

MIGRATIONS = Path(__file__).parent / "migrations"


def upgrade(engine: Engine) -> None:
    """Run what is missing. Alembic's steps hold one transaction each."""
    try:
        with engine.connect() as connection:
            config = Config()
            config.set_main_option("script_location", str(MIGRATIONS).replace("%", "%%"))
            config.attributes["connection"] = connection
            command.upgrade(config, "head")
            connection.commit()
    except CommandError as error:
        raise StoreError(f"store {_shown(engine)} is from another version of gcs: {error}") from None
    except SQLAlchemyError as error:
        raise StoreError(f"store {_shown(engine)} cannot be opened: {_first_line(error)}") from None


def _shown(engine: Engine) -> str:
    """The URL without its password."""
    return engine.url.render_as_string(hide_password=True)


def _first_line(error: SQLAlchemyError) -> str:
    """The driver's words without SQLAlchemy's background link."""
    return str(error).splitlines()[0]
