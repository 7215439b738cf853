"""WS /api/v1/stream: the thin shell around a StreamSession."""

import asyncio
import time
from dataclasses import dataclass
from typing import Annotated

from anyio.to_thread import run_sync
from fastapi import APIRouter, Query, WebSocket
from starlette.websockets import WebSocketDisconnect, WebSocketState

from gcs.api.auth import SUBPROTOCOL, actor_of
from gcs.api.context import ApiContext
from gcs.api.pace import Pace
from gcs.api.problems import problem_response
from gcs.api.rate_limit import Buckets
from gcs.api.schemas import Subscribe, Topic
from gcs.api.stream_session import StreamSession

router = APIRouter()
SEND_TIMEOUT_S = 20.0  # a client that takes nothing for so long is gone
POLICY_VIOLATION = 1008
TRY_AGAIN_LATER = 1013
MESSAGES_PER_S = 10.0  # of one client, twice as many at once: each wakes its session


@dataclass
class Seats:
    """How many clients the stream has room for; of the event loop's thread only."""

    number: int
    _taken: int = 0

    def take(self) -> bool:
        """False when there is no room."""
        if self._taken >= self.number:
            return False
        self._taken += 1
        return True

    def give_back(self) -> None:
        """A client left."""
        self._taken -= 1


class _Gone(Exception):  # noqa: N818 an ordinary end
    """The client left, or talks too much (``code``)."""

    def __init__(self, code: int = TRY_AGAIN_LATER) -> None:
        super().__init__(code)
        self.code = code


@router.websocket("/stream")
async def stream(
    socket: WebSocket,
    rate_hz: Annotated[float, Query(ge=0.1, le=20.0, allow_inf_nan=False)] = 5.0,
    topics: Annotated[list[Topic] | None, Query(max_length=2)] = None,
) -> None:
    """Hello, then snapshots and events at the client's rate until it leaves."""
    seats: Seats = socket.app.state.seats
    if not seats.take():
        detail = f"{seats.number} clients follow the stream, which is as many as it takes ([server] max_streams)"
        await socket.send_denial_response(problem_response(503, detail, instance=socket.url.path))
        return
    try:
        await _serve(socket, rate_hz, topics)
    finally:
        seats.give_back()


async def _serve(socket: WebSocket, rate_hz: float, topics: list[Topic] | None) -> None:
    wish = Subscribe(type="subscribe", rate_hz=rate_hz, topics=topics or ["snapshot", "events"])
    session = _session(socket, wish)
    offered = socket.scope.get("subprotocols", [])
    await socket.accept(SUBPROTOCOL if SUBPROTOCOL in offered else None)
    gauge = socket.app.state.stream_clients
    gauge.inc()
    code = TRY_AGAIN_LATER
    try:
        async with asyncio.TaskGroup() as group:
            changed = asyncio.Event()
            group.create_task(_listen(socket, session, changed))
            group.create_task(_tell(socket, session, changed))
    except* _Gone as ended:
        code = max(gone.code for gone in ended.exceptions if isinstance(gone, _Gone))
    finally:
        gauge.dec()
        if socket.application_state is not WebSocketState.DISCONNECTED:
            await _close(socket, code)


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
    buckets = Buckets(MESSAGES_PER_S, 2.0 * MESSAGES_PER_S)
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            raise _Gone
        if buckets.take("", time.monotonic()) > 0.0:
            raise _Gone(POLICY_VIOLATION)
        answer = session.hear(message.get("text") or "")
        if answer is not None:
            await _send(socket, answer)
        changed.set()


async def _tell(socket: WebSocket, session: StreamSession, changed: asyncio.Event) -> None:
    """A step that has to read a new campaign's mission from the store is made beside the event loop, all others here.

    A thread's turn and back cost more than the step, whose words are mostly made already (``Tick``).
    """
    context: ApiContext = socket.app.state.context
    pace: Pace = socket.app.state.pace
    await _send(socket, await run_sync(session.hello, limiter=context.stream_workers))
    while True:
        changed.clear()
        at_once = session.at_hand()
        for text in session.step() if at_once else await run_sync(session.step, limiter=context.stream_workers):
            await _send(socket, text)
        await pace.turn(session.wish.rate_hz, changed)


async def _send(socket: WebSocket, text: str) -> None:
    try:
        async with asyncio.timeout(SEND_TIMEOUT_S):
            await socket.send_text(text)
    except (TimeoutError, WebSocketDisconnect, RuntimeError) as error:  # RuntimeError: closed meanwhile
        raise _Gone from error


async def _close(socket: WebSocket, code: int) -> None:
    try:
        await socket.close(code)
    except (WebSocketDisconnect, RuntimeError):
        return
