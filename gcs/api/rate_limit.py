"""So many requests a second from one address, so that no client keeps the server from the others."""

import math
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field

from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from gcs.api.problems import problem_response

KEPT_CLIENTS = 10_000  # the one that was silent longest is forgotten first, with a full bucket


@dataclass
class Buckets:
    """A token bucket for each client: ``per_s`` on the long run, ``burst`` at once."""

    per_s: float
    burst: float
    _levels: OrderedDict[str, tuple[float, float]] = field(default_factory=OrderedDict)  # tokens, when

    def take(self, client: str, now_s: float) -> float:
        """0 when the request may pass, else seconds until the next one may."""
        tokens, since_s = self._levels.pop(client, (self.burst, now_s))
        tokens = min(self.burst, tokens + max(0.0, now_s - since_s) * self.per_s)
        passes = tokens >= 1.0
        self._levels[client] = (tokens - 1.0 if passes else tokens, now_s)
        while len(self._levels) > KEPT_CLIENTS:
            self._levels.popitem(last=False)
        return 0.0 if passes else (1.0 - tokens) / self.per_s


class RateLimit:
    """ASGI: 429 with Retry-After for who asks too often. Liveness is never refused."""

    def __init__(self, app: ASGIApp, buckets: Buckets, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._app, self._buckets, self._clock_s = app, buckets, clock_s

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request or socket."""
        wait_s = 0.0
        if scope["type"] in {"http", "websocket"} and scope["path"] != "/healthz":
            wait_s = self._buckets.take((scope.get("client") or ("unknown", 0))[0], self._clock_s())
        if wait_s == 0.0:
            await self._app(scope, receive, send)
            return
        detail = f"more than {self._buckets.per_s:g} requests a second from one address; send batches"
        headers = {"retry-after": str(math.ceil(wait_s))}
        response = problem_response(429, detail, instance=scope["path"], headers=headers)
        if scope["type"] == "websocket":
            await WebSocket(scope, receive, send).send_denial_response(response)
        else:
            await response(scope, receive, send)
