"""A real server with the built page, over a small real flight."""

import socket
import threading
from pathlib import Path

import uvicorn
from moving_flight import MovingFlight

from gcs.api.app import create_app
from gcs.api.settings import ApiSettings, MapTiles
from gcs.ports import FlightControl
from gcs.store.store import Store

PAGE = Path(__file__).resolve().parents[2] / "gcs" / "dashboard"
KEY = "operator-key-of-the-test"


class Desk:
    """The server's side: stopped and started again on the same port, as after a crash."""

    def __init__(self, store: Store, control: FlightControl | None = None) -> None:
        self.store = store
        self.flight = MovingFlight(store.journal)
        self._control = control or self.flight
        self.map_tiles = MapTiles()
        self._port = 0
        self._server: uvicorn.Server | None = None
        self._thread: threading.Thread | None = None

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self._port}/"

    def start(self) -> None:
        listener = socket.create_server(("127.0.0.1", self._port))
        self._port = listener.getsockname()[1]
        settings = ApiSettings(host="127.0.0.1", one_time_key=KEY, dashboard=PAGE / "dist", map_tiles=self.map_tiles)
        app = create_app(self._control, self.store, settings)
        config = uvicorn.Config(
            app, log_config=None, ws="websockets-sansio", lifespan="off", timeout_graceful_shutdown=1
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run, kwargs={"sockets": [listener]})
        self._thread.start()

    def stop(self) -> None:
        if self._server is None or self._thread is None:
            return
        self._server.should_exit = True
        self._thread.join(20.0)
        for one in self._server.servers:
            one.close()
        self._server = self._thread = None
