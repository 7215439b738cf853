"""Refuses bodies that no campaign needs, before they fill the memory."""

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from policy.service.problems import problem

MAX_BODY_BYTES = 8_000_000
"""10,000 users at eight numbers of twenty digits are 1.6 MB."""


class BodyLimit:
    """ASGI middleware: counts what arrives, whatever Content-Length says."""

    def __init__(self, app: ASGIApp, limit_bytes: int = MAX_BODY_BYTES) -> None:
        """Stands in front of ``app``."""
        self._app = app
        self._limit_bytes = limit_bytes

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer 413."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        body = await self._read(receive)
        if body is None:
            detail = f"the body is larger than {self._limit_bytes} bytes"
            await problem(413, detail)(scope, receive, send)
            return
        pending = [body]

        async def replay() -> Message:
            if pending:
                return {"type": "http.request", "body": pending.pop(), "more_body": False}
            return await receive()

        await self._app(scope, replay, send)

    async def _read(self, receive: Receive) -> bytes | None:
        """The whole body, or None when it is too large or the client has gone."""
        parts: list[bytes] = []
        size = 0
        while True:
            message = await receive()
            if message["type"] != "http.request":
                return b"".join(parts)
            parts.append(message.get("body", b""))
            size += len(parts[-1])
            if size > self._limit_bytes:
                return None
            if not message.get("more_body", False):
                return b"".join(parts)
