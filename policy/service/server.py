"""Runs the HTTP service on a socket that is bound before anything else, so that a port in use is one clear line."""

import contextlib
import socket

import uvicorn

from policy.agents.registry import PolicyChoice
from policy.service.app import create_app


class ServerError(ValueError):
    """The address cannot be listened on: one line."""


def bind(host: str, port: int) -> socket.socket:
    """A listening socket. Raises :class:`ServerError`."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        bound = socket.socket(family, kind, protocol)
    except (OSError, UnicodeError) as error:
        raise ServerError(f"--host {host}: is no address of this machine: {error}") from error
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind(address)
        bound.listen()  # from now on clients wait instead of being refused
    except OSError as error:
        bound.close()
        raise ServerError(f"cannot listen on {host}:{port}: {error.strerror}; choose another --port") from error
    return bound


def serve(host: str, port: int, default: PolicyChoice | None) -> None:
    """Serve until interrupted; says on stdout where."""
    bound = bind(host, port)
    config = uvicorn.Config(create_app(default), log_level="warning", access_log=False)
    shown = f"[{host}]" if ":" in host else host
    print(f"policy service ready: http://{shown}:{bound.getsockname()[1]}", flush=True)
    # uvicorn closes its connections first, then raises what stopped it; for a server that is an orderly end.
    with bound, contextlib.suppress(KeyboardInterrupt):
        uvicorn.Server(config).run(sockets=[bound])
