"""WS /api/v1/stream: the thin shell around a StreamSession."""

import asyncio
from typing import Annotated

from fastapi import APIRouter, Query, WebSocket
from starlette.concurrency import run_in_threadpool
from starlette.websockets import WebSocketDisconnect, WebSocketState

from gcs.api.auth import SUBPROTOCOL, actor_of
from gcs.api.context import ApiContext
from gcs.api.schemas import Subscribe, Topic
from gcs.api.stream_session import StreamSession

router = APIRouter()
SEND_TIMEOUT_S = 20.0  # a client that takes nothing for so long is gone
TRY_AGAIN_LATER = 1013


class _Gone(Exception):  # noqa: N818 an ordinary end
    """The client left."""


@router.websocket("/stream")
async def stream(
    socket: WebSocket,
    rate_hz: Annotated[float, Query(ge=0.1, le=20.0, allow_inf_nan=False)] = 5.0,
    topics: Annotated[list[Topic] | None, Query(max_length=2)] = None,
) -> None:
    """Hello, then snapshots and events at the client's rate until it leaves."""
    wish = Subscribe(type="subscribe", rate_hz=rate_hz, topics=topics or ["snapshot", "events"])
    session = _session(socket, wish)
    offered = socket.scope.get("subprotocols", [])
    await socket.accept(SUBPROTOCOL if SUBPROTOCOL in offered else None)
    gauge = socket.app.state.stream_clients
    gauge.inc()
    try:
        async with asyncio.TaskGroup() as group:
            changed = asyncio.Event()
            group.create_task(_listen(socket, session, changed))
            group.create_task(_tell(socket, session, changed))
    except* _Gone:
        pass
    finally:
        gauge.dec()
        if socket.application_state is not WebSocketState.DISCONNECTED:
            await _close(socket)


def _session(socket: WebSocket, wish: Subscribe) -> StreamSession:
    context: ApiContext = socket.app.state.context
    return StreamSession(
        actor=actor_of(socket.scope),
        version=context.settings.version,
        source=socket.app.state.snapshots,
        tail=context.store.tail,
        statics=context.catalog,
        wish=wish,
    )


async def _listen(socket: WebSocket, session: StreamSession, changed: asyncio.Event) -> None:
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise _Gone
        answer = session.hear(message.get("text") or "")
        if answer is not None:
            await _send(socket, answer)
        changed.set()


async def _tell(socket: WebSocket, session: StreamSession, changed: asyncio.Event) -> None:
    """A new campaign's mission may have to be read from the store, so steps are made beside the event loop."""
    await _send(socket, await run_in_threadpool(session.hello))
    while True:
        changed.clear()
        for text in await run_in_threadpool(lambda: list(session.step())):
            await _send(socket, text)
        await _wait(changed, 1.0 / session.wish.rate_hz)


async def _wait(changed: asyncio.Event, timeout_s: float) -> None:
    try:
        async with asyncio.timeout(timeout_s):
            await changed.wait()
    except TimeoutError:
        return


async def _send(socket: WebSocket, text: str) -> None:
    try:
        async with asyncio.timeout(SEND_TIMEOUT_S):
            await socket.send_text(text)
    except (TimeoutError, WebSocketDisconnect, RuntimeError) as error:  # RuntimeError: closed meanwhile
        raise _Gone from error


async def _close(socket: WebSocket) -> None:
    try:
        await socket.close(TRY_AGAIN_LATER)
    except (WebSocketDisconnect, RuntimeError):
        return
