"""The audit log."""

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Query
from pydantic import AwareDatetime

from gcs.api.bodies import EventPage, EventView
from gcs.api.context import Context
from gcs.ports import Severity
from gcs.store.reading import EventFilter

router = APIRouter(tags=["events"])
MAX_ID = 2**31 - 1


@router.get("/events")
def events(
    context: Context,
    *,
    campaign_id: Annotated[str | None, Query(max_length=64, pattern="^[A-Za-z0-9_-]+$")] = None,
    severity: Annotated[Severity | None, Query(description="this one and all above it")] = None,
    kind: Annotated[str | None, Query(max_length=64, pattern="^[A-Za-z0-9_.-]+$")] = None,
    since: Annotated[AwareDatetime | None, Query(description="recorded then or later, RFC 3339 with zone")] = None,
    after_id: Annotated[int | None, Query(ge=0, le=MAX_ID)] = None,
    limit: Annotated[int, Query(ge=1, le=1000)] = 200,
    newest: Annotated[bool, Query(description="the newest ones that match, still oldest first")] = False,
) -> EventPage:
    """Oldest first; follow ``next_after_id`` for the rest."""
    wanted = EventFilter(campaign_id, severity, kind, _representable(since), after_id)
    log = context.store.events
    skipped = max(0, log.count(wanted) - limit) if newest else 0
    found = log.find(wanted, limit + 1, skipped)
    views = [EventView(**vars(event)) for event in found[:limit]]
    return EventPage(events=views, next_after_id=views[-1].id if len(found) > limit else None)


def _representable(moment: datetime | None) -> datetime | None:
    """A time at the calendar's edge cannot be turned into UTC; nothing was recorded that long ago or so late."""
    if moment is None or 2 <= moment.year <= 9998:
        return moment
    return moment.replace(year=2 if moment.year < 2 else 9998, day=1)
