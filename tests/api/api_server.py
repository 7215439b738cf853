"""A real server on a free port, with a small real flight behind it."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import httpx
from fake_control import FakeControl

from gcs.api.app import create_app
from gcs.api.listening import Tls
from gcs.api.server import make_server
from gcs.api.settings import ApiSettings
from gcs.store.keys import Role
from gcs.store.store import Store

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
def serving(store: Store, settings: ApiSettings, tls: Tls | None = None) -> Iterator[Server]:
    """Run until the test is over, as ``gcs serve`` does."""
    control = FakeControl()
    keys = {role: store.keys.add(role.value, role)[1] for role in Role} if settings.one_time_key is None else {}
    listener = socket.create_server(("127.0.0.1", 0))
    app = create_app(control, store, settings)
    server = make_server(app, tls)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    scheme = "http" if tls is None else "https"
    yield Server(f"{scheme}://127.0.0.1:{listener.getsockname()[1]}", control, store, keys, settings)
    server.should_exit = True
    thread.join(20.0)
    listener.close()
