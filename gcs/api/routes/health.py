"""Liveness, readiness, Prometheus."""

from fastapi import APIRouter, Response
from prometheus_client import CONTENT_TYPE_LATEST, generate_latest
from starlette.requests import Request

from gcs.api.bodies import Liveness, Readiness
from gcs.api.context import Context

router = APIRouter(tags=["health"])


@router.get("/healthz")
async def healthz() -> Liveness:
    """The process answers."""
    return Liveness()


@router.get("/readyz", responses={503: {"model": Readiness}})
async def readyz(context: Context, response: Response) -> Readiness:
    """The flight loop ticks in time and the store takes records."""
    journal = context.store.journal.health()
    problems = [] if context.control.healthy() else ["the flight loop is late"]
    problems += [f"store: {journal.error}"] if journal.error else []
    response.status_code = 503 if problems else 200
    return Readiness(
        ready=not problems,
        problems=problems,
        flight_tick=context.control.snapshot().tick,
        store_queued=journal.queued,
        store_written=journal.written,
        store_lost=journal.lost,
        store_failures=journal.failures,
    )


@router.get("/metrics", include_in_schema=False)
async def metrics(request: Request) -> Response:
    """Prometheus text format."""
    return Response(generate_latest(request.app.state.metrics), media_type=CONTENT_TYPE_LATEST)
