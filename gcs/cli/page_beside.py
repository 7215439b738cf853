"""The server beside a headless flight (``gcs fly --serve``): page and API over the same flight loop."""

import secrets
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from socket import socket

from gcs.api.app import create_app
from gcs.api.listening import open_listener, shown_address
from gcs.api.server import serving
from gcs.api.settings import ApiSettings, is_loopback
from gcs.cli.errors import UsageError
from gcs.ports import FlightControl
from gcs.store.store import Store, using_store
from policy.mission_file import Mission


@dataclass(frozen=True)
class Page:
    """A store for this flight only, and a port that is ours."""

    store: Store
    listener: socket
    settings: ApiSettings

    @property
    def address(self) -> str:
        """The URL to open."""
        return shown_address(self.listener)

    @contextmanager
    def showing(self, control: FlightControl, mission: Mission, campaign_id: str) -> Iterator[None]:
        """Serve while the flight goes on; the campaign stands in the store under its id."""
        self.store.campaigns.create(mission, "gcs fly", campaign_id=campaign_id)
        with serving(create_app(control, self.store, self.settings), self.listener):
            yield


@contextmanager
def open_page(address: str, seats: tuple[int, ...] = ()) -> Iterator[Page]:
    """Take the port before anything flies. Raises UsageError, ListenError."""
    host, port = _host_port(address)
    settings = ApiSettings(host=host, seats=seats, one_time_key=secrets.token_urlsafe(24))
    listener = open_listener(host, port)
    try:
        with tempfile.TemporaryDirectory(prefix="gcs-flight-") as folder:
            url = f"sqlite:///{Path(folder).as_posix()}/flight.db"
            with using_store(url) as store:
                yield Page(store, listener, settings)
    finally:
        listener.close()


def _host_port(address: str) -> tuple[str, int]:
    host, colon, port = address.rpartition(":")
    if not colon or not port.isdecimal() or int(port) > 65535:
        raise UsageError(f"--serve {address!r} is not HOST:PORT, e.g. 127.0.0.1:8080")
    host = host.strip("[]")
    if not is_loopback(host):
        raise UsageError(f"--serve {address}: other machines need API keys; use `gcs serve` for them, or 127.0.0.1")
    return host, int(port)
