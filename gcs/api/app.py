"""The application: routes, errors and the layers around them. ``create_app`` is all that others need."""

import time
from collections.abc import Callable
from typing import Any

from fastapi import FastAPI, Security
from fastapi.security import HTTPBearer
from starlette.types import Scope

from gcs.api import documentation, page, problems
from gcs.api.auth import Door, Gatekeeper, Refusal
from gcs.api.bodies import ProblemDocument
from gcs.api.context import ApiContext
from gcs.api.durable import Durable
from gcs.api.guards import BodyLimit, SafeHeaders, SameOrigin
from gcs.api.idempotency import Idempotency
from gcs.api.live_users import LiveCampaigns
from gcs.api.pace import Pace
from gcs.api.problems import MEDIA_TYPE
from gcs.api.rate_limit import Buckets, RateLimit
from gcs.api.routes import (
    acknowledgements,
    campaigns,
    drones,
    dry_runs,
    events,
    explanations,
    health,
    keys,
    live,
    map_tiles,
    recordings,
    reports,
    reports_socket,
    series,
    session,
    shelf,
    stream,
)
from gcs.api.settings import ApiSettings, is_loopback
from gcs.api.stream_source import SnapshotSource
from gcs.api.telemetry import HttpMetrics, new_registry
from gcs.ports import FlightControl, Severity
from gcs.store.store import Store

REFUSALS_A_SECOND = 5  # in the audit log; strangers cannot fill the store, /metrics counts them all
NO_TELEMETRY: Any = {"tracing": False, "metrics": False, "logs": False}
"""FastAPI's own hooks for OpenTelemetry: nobody listens, /metrics counts, and to ask costs 8 % of each request."""

BEARER = HTTPBearer(auto_error=False, description="python -m gcs keys add makes one")  # for the documentation only

PROBLEMS: dict[int | str, dict[str, Any]] = {
    status: {"description": words, "content": {MEDIA_TYPE: {"schema": ProblemDocument.model_json_schema()}}}
    for status, words in {
        401: "no good key",
        403: "the role is not enough",
        404: "nothing there",
        409: "the state forbids it",
        413: "the body is too large",
        422: "not understood",
        429: "too many requests",
        503: "the flight loop did not answer",
    }.items()
}


def create_app(
    control: FlightControl, store: Store, settings: ApiSettings, live: LiveCampaigns | None = None
) -> FastAPI:
    """REST, WebSocket and page over a running flight. ``live`` is shared with who flies live users' campaigns."""
    context = ApiContext(control, store, settings, live or LiveCampaigns())
    app = FastAPI(
        title="UAV crowdsensing ground control",
        version=settings.version,
        docs_url=None,
        redoc_url=None,
        telemetry=NO_TELEMETRY,
    )
    app.state.context = context
    app.state.snapshots = SnapshotSource(control, store.tail, context.catalog)
    app.state.pace = Pace(control)
    app.state.seats = stream.Seats(settings.max_streams)
    app.state.metrics, app.state.stream_clients = new_registry(context)
    problems.install(app)
    _include_routes(app)
    documentation.install(app)
    page.install(app, settings.dashboard)
    _add_layers(app, context)
    return app


def _include_routes(app: FastAPI) -> None:
    looking = (reports, recordings, series, explanations, dry_runs, shelf, events, map_tiles)
    for module in (campaigns, *looking, live, drones, acknowledgements, keys, session):
        app.include_router(module.router, prefix="/api/v1", dependencies=[Security(BEARER)], responses=PROBLEMS)
    app.include_router(stream.router, prefix="/api/v1")
    app.include_router(reports_socket.router, prefix="/api/v1")
    app.include_router(health.router)


def _add_layers(app: FastAPI, context: ApiContext) -> None:
    """The last one added is the outermost."""
    settings = context.settings
    door = Door(context.store.keys, settings)
    app.add_middleware(Durable, journal=context.store.journal)
    app.add_middleware(Idempotency, answers=context.store.answers)
    app.add_middleware(BodyLimit, max_bytes=settings.max_body_bytes)
    app.add_middleware(Gatekeeper, door=door, on_refusal=_refusal_log(context))
    app.add_middleware(SameOrigin, local_names_only=is_loopback(settings.host))
    app.add_middleware(RateLimit, buckets=Buckets(settings.rate_per_s, 2.0 * settings.rate_per_s))
    app.add_middleware(SafeHeaders, tiles_origin=settings.map_tiles.origin)
    app.add_middleware(HttpMetrics, registry=app.state.metrics)


def _refusal_log(context: ApiContext) -> Callable[[Scope, Refusal], None]:
    """Refused changes go to the audit log, a few a second."""
    told: list[float] = []

    def log(scope: Scope, refusal: Refusal) -> None:
        now_s = time.monotonic()
        told[:] = [moment for moment in told if now_s - moment < 1.0]
        if len(told) >= REFUSALS_A_SECOND:
            return
        told.append(now_s)
        actor = "nobody" if refusal.actor is None else refusal.actor.name
        message = f"{scope.get('method', 'WebSocket')[:20]} {scope['path'][:200]} refused: {refusal.status}"
        context.audit(actor, "api.refused", message, severity=Severity.CAUTION)

    return log
