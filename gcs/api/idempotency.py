"""Idempotency-Key: a change that is asked for again under the same key gets the first answer and is done once.

A client that lost the answer (a broken link, a killed server) repeats the request with the same key. The key is
claimed in the store before the request acts, and its answer is in the store before it leaves: who has had an answer
gets it again, whatever happens to the server. Where the server died in between nobody knows what came of it: 409 says
so, and nothing is done a second time. Keys belong to who sends them and are kept for a day.
"""

import hashlib
import logging

from sqlalchemy.exc import SQLAlchemyError
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import Headers
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gcs.api.auth import SAFE_METHODS, actor_of
from gcs.api.problems import MEDIA_TYPE, problem_response
from gcs.store.answers import Answer, Answers

logger = logging.getLogger(__name__)
HEADER = "idempotency-key"
MAX_KEY = 128
SECRET_PATHS = "/api/v1/keys"  # noqa: S105  their answers are shown once and never kept


class Idempotency:
    """ASGI, inside the gatekeeper: knows who asks."""

    def __init__(self, app: ASGIApp, answers: Answers) -> None:
        self._app, self._answers = app, answers

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        key = Headers(scope=scope).get(HEADER) if scope["type"] == "http" else None
        if key is None or not _may_be_kept(scope):
            await self._app(scope, receive, send)
        elif not 1 <= len(key) <= MAX_KEY or not key.isprintable():
            detail = f"Idempotency-Key: should be 1 to {MAX_KEY} printable characters"
            await problem_response(422, detail, instance=scope["path"])(scope, receive, send)
        else:
            await self._once(key, scope, receive, send)

    async def _once(self, key: str, scope: Scope, receive: Receive, send: Send) -> None:
        messages = await _whole_body(receive)
        actor, request = actor_of(scope).name, _digest(scope, messages)
        try:
            known = await run_in_threadpool(self._answers.claim, actor, key, request)
        except SQLAlchemyError:
            detail = "the store does not take the Idempotency-Key; nothing was done, see /readyz"
            await problem_response(503, detail, instance=scope["path"])(scope, receive, send)
            return
        if known is not None:
            await _again(known, request, scope)(scope, receive, send)
            return
        heard = _Listener()
        try:
            await self._app(scope, _replay(messages, receive), heard)
        finally:
            await run_in_threadpool(self._keep, actor, key, heard)
        await heard.hand_on(send)

    def _keep(self, actor: str, key: str, heard: "_Listener") -> None:
        """A store that takes no answer now must not hide what was done: the key stays claimed, and again is a 409."""
        try:
            if heard.status < 500:
                self._answers.settle(actor, key, heard.status, heard.body.decode())
            elif heard.status != 503:  # 503: it may still act
                self._answers.give_up(actor, key)
        except SQLAlchemyError as error:
            logger.warning("the answer under an Idempotency-Key was not kept: %s", str(error).splitlines()[0])


def _may_be_kept(scope: Scope) -> bool:
    path: str = scope["path"]
    return scope["method"] not in SAFE_METHODS and path.startswith("/api/") and not path.startswith(SECRET_PATHS)


class _Listener:
    """Holds an answer back; answers to changes are small."""

    def __init__(self) -> None:
        self.status, self.body = 500, b""
        self._messages: list[Message] = []

    async def __call__(self, message: Message) -> None:
        if message["type"] == "http.response.start":
            self.status = message["status"]
        elif message["type"] == "http.response.body":
            self.body += message.get("body", b"")
        self._messages.append(message)

    async def hand_on(self, send: Send) -> None:
        """The whole answer, as it was given."""
        for message in self._messages:
            await send(message)


def _again(known: Answer, request: str, scope: Scope) -> Response:
    if known.request != request:
        detail = "this Idempotency-Key was used for another request; use a new key for a new request"
        return problem_response(422, detail, instance=scope["path"])
    if known.status is None:
        detail = (
            "the first request with this Idempotency-Key is being worked on, or the server ended over it: "
            "look at /api/v1/events for what became of it before you ask with a new key"
        )
        return problem_response(409, detail, instance=scope["path"])
    media_type = MEDIA_TYPE if known.status >= 400 else "application/json"
    return Response(known.body, known.status, {"idempotency-replayed": "true"}, media_type)


async def _whole_body(receive: Receive) -> list[Message]:
    """The layer around has limited its size."""
    messages = [await receive()]
    while messages[-1].get("more_body", False):
        messages.append(await receive())
    return messages


def _digest(scope: Scope, messages: list[Message]) -> str:
    head = f"{scope['method']} {scope['path']}?{scope['query_string'].decode('latin-1')}\n"
    return hashlib.sha256(head.encode() + b"".join(m.get("body", b"") for m in messages)).hexdigest()


def _replay(messages: list[Message], receive: Receive) -> Receive:
    waiting = iter(messages)

    async def replay() -> Message:
        return next(waiting, None) or await receive()

    return replay
