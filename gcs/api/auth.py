"""Who may do what, decided once for every path by a table, so that no route can forget to ask.

Reading needs a viewer, changing anything an operator, keys an admin; what phones report needs a reporter. A key comes
as ``Authorization: Bearer KEY``; a browser's WebSocket cannot set headers and says it as the subprotocol
``bearer.KEY`` beside ``ucs.v1``.
"""

import hmac
import re
from collections.abc import Callable
from dataclasses import dataclass

from sqlalchemy.exc import SQLAlchemyError
from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocket

from gcs.api.problems import problem_response
from gcs.api.settings import ApiSettings
from gcs.store.keys import Keys, Role

SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
SUBPROTOCOL = "ucs.v1"
KEY_SUBPROTOCOL = "bearer."
REPORTS = re.compile(r"/api/v1/campaigns/[^/]+/(fixes|uploads|departures|reports)")  # what phones send
CHALLENGE = {"www-authenticate": 'Bearer realm="gcs"'}


@dataclass(frozen=True)
class Actor:
    """Who asks; ``name`` stands in the audit log."""

    name: str
    role: Role


OPEN_READER = Actor("loopback", Role.VIEWER)
ONE_TIME_OPERATOR = Actor("one-time-key", Role.OPERATOR)


@dataclass(frozen=True)
class Refusal:
    """Not let in. ``actor`` is known when the key was good and the role was not enough."""

    status: int
    detail: str
    actor: Actor | None = None


@dataclass(frozen=True)
class Door:
    """The rules, without any I/O but the key table."""

    keys: Keys
    settings: ApiSettings

    def admit(self, scope: Scope) -> Actor | Refusal | None:
        """The actor, the refusal, or None where nobody needs to be anybody."""
        needed = needed_role(scope)
        if needed is None:
            return None
        text = presented_key(scope)
        actor = self._who(text)
        if actor is None or (text is None and not actor.role.allows(needed)):
            reason = "no key was given" if text is None else "this key is not known or was revoked"
            return Refusal(401, f"{reason}: send Authorization: Bearer KEY (python -m gcs keys add makes one)")
        if not actor.role.allows(needed):
            return Refusal(403, f'this needs the role {needed}, and "{actor.name}" is {actor.role}', actor)
        return actor

    def _who(self, text: str | None) -> Actor | None:
        if text is None:
            return OPEN_READER if self.settings.open_reading else None
        one_time = self.settings.one_time_key
        if one_time is not None and hmac.compare_digest(_bytes(text), _bytes(one_time)):
            return ONE_TIME_OPERATOR
        record = self.keys.verify(text)
        return None if record is None else Actor(record.name, record.role)


def needed_role(scope: Scope) -> Role | None:
    """The table: path and method to role; None for what holds no data (page, documentation, health)."""
    path: str = scope["path"]
    if path == "/metrics":
        return Role.VIEWER
    if not path.startswith("/api/"):
        return None
    if path == "/api/v1/keys" or path.startswith("/api/v1/keys/"):
        return Role.ADMIN
    if REPORTS.fullmatch(path) and (scope["type"] == "websocket" or scope.get("method") == "POST"):
        return Role.REPORTER
    return Role.VIEWER if scope.get("method", "GET") in SAFE_METHODS else Role.OPERATOR


def presented_key(scope: Scope) -> str | None:
    """The key's text, or None when none was given."""
    scheme, _, key = Headers(scope=scope).get("authorization", "").partition(" ")
    if scheme.lower() == "bearer" and key.strip():
        return key.strip()
    offered = [name for name in scope.get("subprotocols", []) if name.startswith(KEY_SUBPROTOCOL)]
    return offered[0].removeprefix(KEY_SUBPROTOCOL) if offered else None


def actor_of(scope: Scope) -> Actor:
    """Whom the gatekeeper let in."""
    actor: Actor = scope["state"]["actor"]
    return actor


class Gatekeeper:
    """ASGI: lets in or answers with the refusal; ``on_refusal`` is told of refused changes, for the audit log."""

    def __init__(self, app: ASGIApp, door: Door, on_refusal: Callable[[Scope, Refusal], None]) -> None:
        self._app, self._door, self._on_refusal = app, door, on_refusal

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request or socket."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        match self._admit(scope):
            case Refusal(503) as refusal:
                await _refuse(scope, receive, send, refusal)
            case Refusal() as refusal:
                self._on_refusal(scope, refusal)
                await _refuse(scope, receive, send, refusal)
            case actor:
                scope.setdefault("state", {})["actor"] = actor
                await self._app(scope, receive, send)

    def _admit(self, scope: Scope) -> Actor | Refusal | None:
        """A store that is away knows no keys: nobody gets in, and that is not the client's mistake."""
        try:
            return self._door.admit(scope)
        except SQLAlchemyError:
            return Refusal(503, "the store does not answer, so no key can be checked; nothing was done, see /readyz")


async def _refuse(scope: Scope, receive: Receive, send: Send, refusal: Refusal) -> None:
    headers = CHALLENGE if refusal.status == 401 else {"retry-after": "5"} if refusal.status == 503 else {}
    response = problem_response(refusal.status, refusal.detail, instance=scope["path"], headers=headers)
    if scope["type"] == "websocket":
        await WebSocket(scope, receive, send).send_denial_response(response)
    else:
        await response(scope, receive, send)


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")
