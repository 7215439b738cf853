"""ASGI layers around the routes: the size of bodies, the names that a local server answers to, safe headers."""

from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

from gcs.api.problems import problem_response
from gcs.api.settings import is_loopback

PAGE_POLICY = (
    "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self'; worker-src 'self' blob:; object-src 'none'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'"
)
REPORT_POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'; sandbox"
MAX_QUERY_BYTES = 8_192


class SafeHeaders:
    """Tells browsers to trust nothing but this server; API answers are never kept by caches."""

    def __init__(self, app: ASGIApp, *, tiles_origin: str | None = None) -> None:
        self._app, self._policy = app, page_policy(tiles_origin)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                _add_headers(MutableHeaders(scope=message), scope["path"], self._policy)
                if scope.get("scheme") == "https":
                    MutableHeaders(scope=message).setdefault("strict-transport-security", "max-age=31536000")
            await send(message)

        await self._app(scope, receive, send_with_headers)


def page_policy(tiles_origin: str | None) -> str:
    """What the page may ask: this server, and the configured one for map tiles."""
    if tiles_origin is None:
        return PAGE_POLICY
    return PAGE_POLICY.replace("img-src 'self'", f"img-src 'self' {tiles_origin}").replace(
        "connect-src 'self'", f"connect-src 'self' {tiles_origin}"
    )


def _add_headers(headers: MutableHeaders, path: str, policy: str) -> None:
    headers.setdefault("content-security-policy", policy)
    headers.setdefault("x-content-type-options", "nosniff")
    headers.setdefault("x-frame-options", "DENY")
    headers.setdefault("referrer-policy", "no-referrer")
    headers.setdefault("cross-origin-opener-policy", "same-origin")
    if path.startswith("/api/"):
        headers.setdefault("cache-control", "no-store")


class SameOrigin:
    """Keeps other web pages out of a server that trusts its own machine.

    A page elsewhere can point its own name at 127.0.0.1 (DNS rebinding) or open a WebSocket to any address; on
    loopback only local names are answered, and a WebSocket's Origin must be the host that it asks.
    """

    def __init__(self, app: ASGIApp, *, local_names_only: bool) -> None:
        self._app, self._local_names_only = app, local_names_only

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request or socket."""
        detail = self._refusal(scope) if scope["type"] in {"http", "websocket"} else ""
        if not detail:
            await self._app(scope, receive, send)
            return
        response = problem_response(403, detail, instance=scope["path"])
        if scope["type"] == "websocket":
            await WebSocket(scope, receive, send).send_denial_response(response)
        else:
            await response(scope, receive, send)

    def _refusal(self, scope: Scope) -> str:
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        if self._local_names_only and not is_loopback(_hostname(f"//{host}")):
            return "this server answers to localhost only: open it by 127.0.0.1 or localhost"
        origin = headers.get("origin")
        changes = scope["type"] == "websocket" or scope["method"] not in {"GET", "HEAD", "OPTIONS"}
        if changes and origin is not None and _origin_host(origin) != host.lower():
            return "another web page may not use this server"
        return ""


def _hostname(url: str) -> str:
    try:
        return urlsplit(url).hostname or ""
    except ValueError:
        return ""


def _origin_host(origin: str) -> str:
    """host:port of an Origin, lower case; empty for ``null`` and rubbish."""
    try:
        return urlsplit(origin).netloc.lower()
    except ValueError:
        return ""


class BodyLimit:
    """413 for a body above ``max_bytes``, announced or not; 414 for an endless query."""

    def __init__(self, app: ASGIApp, max_bytes: int) -> None:
        self._app, self._max_bytes = app, max_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
        elif len(scope["query_string"]) > MAX_QUERY_BYTES:
            detail = f"the query is longer than {MAX_QUERY_BYTES} bytes"
            await problem_response(414, detail, instance=scope["path"])(scope, receive, send)
        elif _announced_bytes(scope) > self._max_bytes:
            await self._too_large(scope, receive, send)
        else:
            await self._count(scope, receive, send)

    async def _count(self, scope: Scope, receive: Receive, send: Send) -> None:
        """A chunked body is read here, whole, and handed on: an app that was told half of it would misread it."""
        chunks: list[Message] = []
        total = 0
        while True:
            message = await receive()
            chunks.append(message)
            total += len(message.get("body", b""))
            if total > self._max_bytes:
                await self._too_large(scope, receive, send)
                return
            if not message.get("more_body", False):
                break
        await self._app(scope, _replay(chunks, receive), send)

    async def _too_large(self, scope: Scope, receive: Receive, send: Send) -> None:
        detail = f"the body is larger than {self._max_bytes} bytes; send it in smaller batches"
        response = problem_response(413, detail, instance=scope["path"], headers={"connection": "close"})
        await response(scope, receive, send)


def _announced_bytes(scope: Scope) -> int:
    text = Headers(scope=scope).get("content-length", "0")
    return int(text) if text.isascii() and text.isdigit() and len(text) < 20 else 0


def _replay(chunks: list[Message], receive: Receive) -> Receive:
    waiting = iter(chunks)

    async def replay() -> Message:
        return next(waiting, None) or await receive()

    return replay
