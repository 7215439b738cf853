"""WS /api/v1/campaigns/{id}/reports: what phones send, over one connection that stays open.

Each message holds up to 100 fixes, receipts or departures with a number; the answer says with the same number what
became of them, as REST would. A client that lost the connection sends again what was not answered: fixes, receipts and
departures that come twice change nothing.
"""

import time
from typing import Annotated, Any

from fastapi import APIRouter, WebSocket
from pydantic import Field, TypeAdapter, ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.websockets import WebSocketDisconnect

from gcs.api.auth import SUBPROTOCOL, Actor, actor_of
from gcs.api.bodies import DeparturesMessage, DeparturesTaken, FixesMessage, FixesTaken, UploadsMessage, UploadsTaken
from gcs.api.context import ApiContext
from gcs.api.durable import PATIENCE_S
from gcs.api.problems import Problem
from gcs.api.rate_limit import Buckets
from gcs.api.routes.live import live_users, take_departures, take_fixes, take_uploads

router = APIRouter()
Report = Annotated[FixesMessage | UploadsMessage | DeparturesMessage, Field(discriminator="type")]
REPORT: TypeAdapter[FixesMessage | UploadsMessage | DeparturesMessage] = TypeAdapter(Report)
MESSAGES_PER_S = 50.0  # of one connection, twice as many at once; who sends more is slowed down by closing
POLICY_VIOLATION = 1008


@router.websocket("/campaigns/{campaign_id}/reports")
async def reports(socket: WebSocket, campaign_id: str) -> None:
    """Take reports until the client leaves, sends too much, or the campaign takes none."""
    context: ApiContext = socket.app.state.context
    offered = socket.scope.get("subprotocols", [])
    await socket.accept(SUBPROTOCOL if SUBPROTOCOL in offered else None)
    buckets, actor = Buckets(MESSAGES_PER_S, 2.0 * MESSAGES_PER_S), actor_of(socket.scope)
    try:
        while True:
            text = await socket.receive_text()
            if buckets.take("", time.monotonic()) > 0.0:
                detail = f"more than {MESSAGES_PER_S:g} messages a second; put more reports into each"
                await socket.send_json(_problem(None, 429, detail))
                break
            answer = await run_in_threadpool(_take, context, campaign_id, text, actor)
            await socket.send_json(answer)
            if answer.get("status") in {404, 409}:
                break
        await socket.close(POLICY_VIOLATION)
    except (WebSocketDisconnect, KeyError):  # KeyError: a binary frame has no text
        return


def _take(context: ApiContext, campaign_id: str, text: str, actor: Actor) -> dict[str, Any]:
    """One message: what is to be answered, once its records are in the store."""
    try:
        message = REPORT.validate_json(text)
    except ValidationError as error:
        first = error.errors(include_input=False, include_url=False)[0]
        where = "/".join(map(str, first["loc"])) or "message"
        return _problem(None, 422, f"{where[:100]}: {first['msg'][:200]}")
    try:
        taken = _act(context, campaign_id, message, actor.name)
    except Problem as problem:
        return _problem(message.number, problem.status, problem.detail)
    context.store.journal.settle(PATIENCE_S)
    return {"type": "taken", "number": message.number, **taken.model_dump()}


def _act(
    context: ApiContext, campaign_id: str, message: FixesMessage | UploadsMessage | DeparturesMessage, actor: str
) -> FixesTaken | UploadsTaken | DeparturesTaken:
    users = live_users(context, campaign_id)
    match message:
        case FixesMessage():
            return take_fixes(users, message.fixes)
        case UploadsMessage():
            return take_uploads(context, campaign_id, users, message.uploads, actor)
        case DeparturesMessage():
            return take_departures(context, campaign_id, users, message.departures, actor)


def _problem(number: int | None, status: int, detail: str) -> dict[str, Any]:
    return {"type": "problem", "number": number, "status": status, "detail": detail}
