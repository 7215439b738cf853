"""uvicorn around the application: the port first, then the loop, in this thread or beside another one's work."""

import errno
import signal
import socket
import ssl
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import FrameType

import uvicorn
from fastapi import FastAPI

GOODBYE_S = 3  # for open streams when the server ends
BACKLOG = 128
MAX_CLIENT_MESSAGE_BYTES = 16 * 1024  # clients of the stream only subscribe, phones send a hundred reports
CIPHERS = "ECDHE+AESGCM:ECDHE+CHACHA20"  # of TLS 1.2: forward secrecy and authenticated; 1.3 has no others


class ListenError(OSError):
    """The address cannot be used: one line."""


def open_listener(host: str, port: int) -> socket.socket:
    """A listening socket, so that a port in use is told before anything else has started."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=BACKLOG)
    except OSError as error:
        if error.errno == errno.EADDRINUSE:
            raise ListenError(
                f"port {port} on {host} is in use: end who has it, or choose another with --port"
            ) from None
        raise ListenError(f"cannot listen on {host}:{port}: {error.strerror or error}") from None


@dataclass(frozen=True)
class Tls:
    """PEM files of a certificate with its chain, and of its key."""

    certificate: Path
    key: Path

    def check(self) -> None:
        """Raises ListenError where the two cannot be used, before anything has started."""
        try:
            ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(self.certificate, self.key, _no_password)
        except (OSError, ValueError) as error:  # ssl.SSLError is an OSError
            words = getattr(error, "reason", None) or getattr(error, "strerror", None) or error
            raise ListenError(f"[tls] {self.certificate} with {self.key} cannot be used: {words}") from None


def _no_password() -> str:
    """Nobody is there to type it in."""
    raise ValueError("the key is encrypted; give one without a password, readable by the server alone")


def make_server(app: FastAPI, tls: Tls | None = None) -> uvicorn.Server:
    """Quiet: requests are counted in /metrics and changes stand in the audit log. TLS 1.2 or newer."""
    return uvicorn.Server(
        uvicorn.Config(
            app,
            log_level="warning",
            access_log=False,
            lifespan="off",
            server_header=False,
            ws="websockets-sansio",
            ws_max_size=MAX_CLIENT_MESSAGE_BYTES,
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
        make_server(app, tls).run(sockets=[listener])
    except KeyboardInterrupt:
        return
    finally:
        signal.signal(signal.SIGTERM, before)


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


@contextmanager
def serving(app: FastAPI, listener: socket.socket) -> Iterator[None]:
    """In a thread of its own, beside a flight that has the main thread."""
    server = make_server(app)
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, name="api")
    thread.start()
    try:
        yield
    finally:
        server.should_exit = True
        thread.join()
        listener.close()


def shown_address(listener: socket.socket, *, encrypted: bool = False) -> str:
    """The URL to open."""
    host, port = listener.getsockname()[:2]
    name = "127.0.0.1" if host == "0.0.0.0" else f"[{host}]" if ":" in host else host
    return f"{'https' if encrypted else 'http'}://{name}:{port}/"
