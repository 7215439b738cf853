"""A real server on a free port, with a small real flight behind it."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest
import uvicorn
from fake_control import FakeControl

from gcs.api.app import create_app
from gcs.api.settings import ApiSettings
from gcs.store.keys import Role
from gcs.store.store import Store, open_store

SMALL: dict[str, Any] = {
    "campaign": {"name": "small", "slots": 4, "slot_s": 15.0},
    "area": {"south_west": [40.4203, -86.93], "size_m": [1667.0, 1222.0]},
    "fleet": {"uavs": 2, "altitude_m": 120.0, "max_speed_mps": 18.0, "launch_m": [833.5, 611.0]},
    "users": {"source": "walkers", "count": 5},
    "policy": {"name": "random"},
}
LIVE = SMALL | {"users": {"source": "live", "count": 3}}


@dataclass(frozen=True)
class Server:
    """Everything a test may look at."""

    url: str
    control: FakeControl
    store: Store
    keys: dict[Role, str]
    settings: ApiSettings

    def client(self, role: Role | None = None) -> httpx.Client:
        """A client with the key of ``role``, or without one."""
        headers = {} if role is None else {"authorization": f"Bearer {self.keys[role]}"}
        return httpx.Client(base_url=self.url, headers=headers, timeout=20.0, trust_env=False)

    @property
    def stream_url(self) -> str:
        return self.url.replace("http", "ws") + "/api/v1/stream"


@contextmanager
def serving(store: Store, settings: ApiSettings) -> Iterator[Server]:
    """Run until the test is over."""
    control = FakeControl()
    keys = {role: store.keys.add(role.value, role)[1] for role in Role} if settings.one_time_key is None else {}
    listener = socket.create_server(("127.0.0.1", 0))
    app = create_app(control, store, settings)
    config = uvicorn.Config(app, log_config=None, ws="websockets-sansio", lifespan="off", timeout_graceful_shutdown=2)
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    yield Server(f"http://127.0.0.1:{listener.getsockname()[1]}", control, store, keys, settings)
    server.should_exit = True
    thread.join(20.0)
    listener.close()


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
