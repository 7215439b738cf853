"""An answer to a change leaves after its records are in the store, so that no client knows more than the log."""

from starlette.concurrency import run_in_threadpool
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gcs.api.auth import SAFE_METHODS
from gcs.store.journal import StoreJournal

PATIENCE_S = 0.25  # the change has happened: a store that stalls is told of, and delays no answer for longer


class Durable:
    """ASGI, innermost: the routes have recorded what they did when their answer begins."""

    def __init__(self, app: ASGIApp, journal: StoreJournal) -> None:
        self._app, self._journal = app, journal

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http" or scope["method"] in SAFE_METHODS:
            await self._app(scope, receive, send)
            return

        async def send_when_kept(message: Message) -> None:
            if message["type"] == "http.response.start":
                await run_in_threadpool(self._journal.settle, PATIENCE_S)
            await send(message)

        await self._app(scope, receive, send_when_kept)
