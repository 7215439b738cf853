"""Servers for the tests: with a key for each role, and local without keys."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from api_server import SMALL, Server, serving

from gcs.api.settings import ApiSettings
from gcs.store.keys import Role
from gcs.store.store import Store, open_store


@pytest.fixture
def server_store(tmp_path: Path) -> Iterator[Store]:
    opened = open_store(f"sqlite:///{tmp_path / 'server.sqlite3'}")
    yield opened
    opened.close()


@pytest.fixture
def keyed(server_store: Store, tmp_path: Path) -> Iterator[Server]:
    """A server with a key for each role."""
    settings = ApiSettings(host="0.0.0.0", dashboard=tmp_path / "none", max_body_bytes=200_000, request_timeout_s=0.5)
    with serving(server_store, settings) as server:
        yield server


@pytest.fixture
def local(server_store: Store, tmp_path: Path) -> Iterator[Server]:
    """A loopback server without configured keys."""
    settings = ApiSettings(host="127.0.0.1", one_time_key="only-once", dashboard=tmp_path / "none")
    with serving(server_store, settings) as server:
        yield server


@pytest.fixture
def operator(keyed: Server) -> Iterator[httpx.Client]:
    with keyed.client(Role.OPERATOR) as client:
        yield client


@pytest.fixture
def campaign_id(operator: httpx.Client) -> str:
    """A campaign that is ready."""
    answer = operator.post("/api/v1/campaigns", json=SMALL)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])
