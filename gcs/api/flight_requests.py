"""Asking the flight thread, and turning its answer into an answer over HTTP."""

import asyncio
from concurrent.futures import Future
from typing import Any

from anyio.to_thread import run_sync

from gcs.api.context import ApiContext
from gcs.api.problems import Problem
from gcs.ports import OperatorRequest, RequestOutcome

DURABLE_S = 0.25  # an order waits for its record so long at most: stopping a drone must not wait for a disk


async def ask(context: ApiContext, request: OperatorRequest, timeout_s: float) -> RequestOutcome:
    """The outcome; 503 when the flight loop does not answer in time (it may still act: the log will tell)."""
    future = asyncio.wrap_future(await run_sync(_submit, context, request, limiter=context.order_workers))
    try:
        # shielded: the flight thread sets the result later, and must not find the future cancelled
        return await asyncio.wait_for(asyncio.shield(future), timeout_s)
    except TimeoutError:
        detail = (
            f"the flight loop did not answer within {timeout_s:g} s; see /readyz and the events for what became of it"
        )
        raise Problem(503, detail) from None


def _submit(context: ApiContext, request: OperatorRequest) -> Future[RequestOutcome]:
    """The request stands in the store before it acts; a slow store delays no order. A start reads files."""
    context.store.journal.settle(DURABLE_S)
    return context.control.submit(request)


async def ask_or_conflict(context: ApiContext, request: OperatorRequest, **members: Any) -> RequestOutcome:
    """Taken up, or 409 with the flight's reason."""
    outcome = await ask(context, request, context.settings.request_timeout_s)
    if not outcome.accepted:
        raise Problem(409, outcome.reason or f"{request.kind} is not possible now", **members)
    return outcome
