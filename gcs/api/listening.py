"""The port and the certificate: checked before anything else has started, and without the weight of a web server."""

import errno
import socket
import ssl
from dataclasses import dataclass
from pathlib import Path

BACKLOG = 128


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


def shown_address(listener: socket.socket, *, encrypted: bool = False) -> str:
    """The URL to open."""
    host, port = listener.getsockname()[:2]
    name = "127.0.0.1" if host == "0.0.0.0" else f"[{host}]" if ":" in host else host
    return f"{'https' if encrypted else 'http'}://{name}:{port}/"
