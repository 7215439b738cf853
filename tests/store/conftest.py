"""A store on SQLite, and on PostgreSQL: UCS_POSTGRES_URL, or a server of our own where its programs are installed."""

import os
import secrets
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from postgres_server import is_installed, postgres_server
from sqlalchemy import create_engine

from gcs.store.store import Store, open_store
from policy.mission_file import Mission, UserSource
from policy.world.scenario import Area, Scenario


@pytest.fixture(scope="session")
def postgres_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A server to make databases on."""
    given = os.environ.get("UCS_POSTGRES_URL")
    if given:
        yield given
        return
    if not is_installed():
        pytest.fail("no PostgreSQL: install Debian's package postgresql, or set UCS_POSTGRES_URL")
    with postgres_server() as url:
        yield url


@pytest.fixture(params=["sqlite", pytest.param("postgres", marks=pytest.mark.postgres)])
def store_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """A database of its own for each test."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'store.sqlite3'}"
        return
    name = f"ucs_test_{secrets.token_hex(6)}"
    admin = create_engine(request.getfixturevalue("postgres_url"), isolation_level="AUTOCOMMIT")
    with admin.connect() as connection:
        connection.exec_driver_sql(f"CREATE DATABASE {name}")
    yield admin.url.set(database=name).render_as_string(hide_password=False)
    with admin.connect() as connection:
        connection.exec_driver_sql(f"DROP DATABASE {name} WITH (FORCE)")
    admin.dispose()


@pytest.fixture
def store(store_url: str) -> Iterator[Store]:
    """Open, empty."""
    opened = open_store(store_url)
    yield opened
    opened.close()


@pytest.fixture
def mission() -> Mission:
    """A small campaign."""
    area = Area((40.42, -86.93), (1000.0, 800.0))
    scenario = Scenario(area, np.array([[500.0, 400.0]]), np.full(3, 0.02), slots=4)
    document = {"campaign": {"name": "small"}}
    return Mission("small", scenario, UserSource("walkers", walkers=3), "random", None, "fresh", document, None)


@pytest.fixture
def campaign_id(store: Store, mission: Mission) -> str:
    """A campaign that is ready."""
    return store.campaigns.create(mission, "tester").id
