"""The audit log."""

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import AwareDatetime

from gcs.api.bodies import EventPage, EventView
from gcs.api.context import Context
from gcs.ports import Severity
from gcs.store.reading import EventFilter, Events

router = APIRouter(tags=["events"])
MAX_ID = 2**31 - 1


@router.get("/events", response_model=EventPage)
async def events(
    context: Context,
    *,
    campaign_id: Annotated[str | None, Query(max_length=64, pattern="^[A-Za-z0-9_-]+$")] = None,
    severity: Annotated[Severity | None, Query(description="this one and all above it")] = None,
    kind: Annotated[str | None, Query(max_length=64, pattern="^[A-Za-z0-9_.-]+$")] = None,
    since: Annotated[AwareDatetime | None, Query(description="recorded then or later, RFC 3339 with zone")] = None,
    after_id: Annotated[int | None, Query(ge=0, le=MAX_ID)] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 200,
    newest: Annotated[bool, Query(description="the newest ones that match, still oldest first")] = False,
) -> Response:
    """Oldest first; follow ``next_after_id`` for the rest."""
    wanted = EventFilter(campaign_id, severity, kind, _representable(since), after_id)
    asked = ("events", wanted, limit, newest)
    body = await context.remembered.get(asked, lambda: _page(context.store.events, wanted, limit, newest=newest))
    return Response(body, media_type="application/json")


def _page(log: Events, wanted: EventFilter, limit: int, *, newest: bool) -> bytes:
    skipped = max(0, log.count(wanted) - limit) if newest else 0
    found = log.find(wanted, limit + 1, skipped)
    views = [EventView(**vars(event)) for event in found[:limit]]
    page = EventPage(events=views, next_after_id=views[-1].id if len(found) > limit else None)
    return page.model_dump_json().encode()


def _representable(moment: datetime | None) -> datetime | None:
    """A time at the calendar's edge cannot be turned into UTC; nothing was recorded that long ago or so late."""
    if moment is None or 2 <= moment.year <= 9998:
        return moment
    return moment.replace(year=2 if moment.year < 2 else 9998, day=1)
