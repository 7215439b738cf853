"""uvicorn around the application, in this thread or beside another one's work; its port is open already."""

import signal
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

import uvicorn
from anyio.to_thread import current_default_thread_limiter
from fastapi import FastAPI

from gcs.api.listening import Tls
from gcs.api.settings import is_loopback

GOODBYE_S = 3  # for open streams when the server ends
MAX_CLIENT_MESSAGE_BYTES = 16 * 1024  # clients of the stream only subscribe, phones send a hundred reports
WORKERS = 4  # of requests: the flight's thread shares the interpreter with all of them, and each has an equal part
CIPHERS = "ECDHE+AESGCM:ECDHE+CHACHA20"  # of TLS 1.2: forward secrecy and authenticated; 1.3 has no others


class _Server(uvicorn.Server):
    """With few workers, however many requests wait."""

    async def serve(self, sockets: list[socket.socket] | None = None) -> None:
        """The limit belongs to the event loop, so it is set inside."""
        current_default_thread_limiter().total_tokens = WORKERS
        await super().serve(sockets)


def make_server(app: FastAPI, tls: Tls | None = None, *, compress: bool = True) -> uvicorn.Server:
    """Quiet: requests are counted in /metrics and changes stand in the audit log. TLS 1.2 or newer.

    ``compress``: what the stream says. Each client's compression has its own state, so what is said to all is
    compressed for each; on the machine itself that only takes the flight's time.
    """
    return _Server(
        uvicorn.Config(
            app,
            log_level="warning",
            access_log=False,
            lifespan="off",
            server_header=False,
            ws="websockets-sansio",
            ws_max_size=MAX_CLIENT_MESSAGE_BYTES,
            ws_per_message_deflate=compress,
            timeout_graceful_shutdown=GOODBYE_S,
            ssl_certfile=None if tls is None else str(tls.certificate),
            ssl_keyfile=None if tls is None else str(tls.key),
            ssl_ciphers=CIPHERS,
        )
    )


def serve(app: FastAPI, listener: socket.socket, tls: Tls | None = None) -> None:
    """In the main thread, until SIGINT or SIGTERM; returns, so that the caller can put its things away."""
    before = signal.signal(signal.SIGTERM, _interrupt)  # uvicorn raises the signal again when it has stopped
    try:
        make_server(app, tls, compress=_leaves_the_machine(listener)).run(sockets=[listener])
    except KeyboardInterrupt:
        return
    finally:
        signal.signal(signal.SIGTERM, before)


def _leaves_the_machine(listener: socket.socket) -> bool:
    return not is_loopback(str(listener.getsockname()[0]))


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


@contextmanager
def serving(app: FastAPI, listener: socket.socket) -> Iterator[None]:
    """In a thread of its own, beside a flight that has the main thread."""
    server = make_server(app, compress=_leaves_the_machine(listener))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, name="api")
    thread.start()
    try:
        yield
    finally:
        server.should_exit = True
        thread.join()
        listener.close()
