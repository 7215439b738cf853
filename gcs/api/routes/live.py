"""Live users: fixes of where they are, receipts of what they uploaded, and who leaves."""

from collections.abc import Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body

from gcs.api.bodies import (
    MAX_BATCH,
    DepartureBody,
    DeparturesTaken,
    FixBody,
    FixesTaken,
    UploadBody,
    UploadsTaken,
)
from gcs.api.context import ApiContext, Context, Who
from gcs.api.live_users import Fix, LiveUsers
from gcs.api.problems import Problem
from gcs.api.routes.campaigns import CampaignId, require, state_of
from gcs.store.entries import UploadEntry
from gcs.store.records import TERMINAL

router = APIRouter(prefix="/campaigns/{campaign_id}", tags=["live users"])


@router.post("/fixes", status_code=202)
def fixes(
    campaign_id: CampaignId,
    body: Annotated[list[FixBody], Body(min_length=1, max_length=MAX_BATCH)],
    context: Context,
) -> FixesTaken:
    """A batch of user fixes. Late, repeated and misplaced ones are counted and left out; the newest one counts."""
    return take_fixes(live_users(context, campaign_id), body)


@router.post("/uploads", status_code=202)
def uploads(
    campaign_id: CampaignId,
    body: Annotated[list[UploadBody], Body(min_length=1, max_length=MAX_BATCH)],
    context: Context,
    who: Who,
) -> UploadsTaken:
    """A batch of receipts of successful uploads: whoever sends them is judged by them and not by the channel model."""
    users = live_users(context, campaign_id)
    return take_uploads(context, campaign_id, users, body, who.name)


@router.post("/departures", status_code=202)
def departures(
    campaign_id: CampaignId,
    body: Annotated[list[DepartureBody], Body(min_length=1, max_length=MAX_BATCH)],
    context: Context,
    who: Who,
) -> DeparturesTaken:
    """Users who leave: they take no part from the next slot on, and where they were is forgotten."""
    users = live_users(context, campaign_id)
    return take_departures(context, campaign_id, users, body, who.name)


def take_fixes(users: LiveUsers, body: Sequence[FixBody]) -> FixesTaken:
    """Count a batch in."""
    return FixesTaken(**asdict(users.report([Fix(**fix.model_dump()) for fix in body], datetime.now(UTC))))


def take_uploads(
    context: ApiContext, campaign_id: str, users: LiveUsers, body: Sequence[UploadBody], actor: str
) -> UploadsTaken:
    """Judge by them, and record them."""
    now = datetime.now(UTC)
    for receipt in sorted(body, key=lambda one: one.time):
        users.receive(receipt.user, receipt.time, now)
        context.store.journal.put(UploadEntry(campaign_id, receipt.user, receipt.time, receipt.uploaded_mb))
    context.audit(actor, "live.uploads", f"{len(body)} upload receipts", campaign_id=campaign_id)
    return UploadsTaken(accepted=len(body))


def take_departures(
    context: ApiContext, campaign_id: str, users: LiveUsers, body: Sequence[DepartureBody], actor: str
) -> DeparturesTaken:
    """Let them go."""
    gone = [users.depart(one.user, one.time) for one in body]
    context.audit(actor, "live.departures", f"{sum(gone)} users left", campaign_id=campaign_id)
    return DeparturesTaken(accepted=sum(gone), stale=len(gone) - sum(gone))


def live_users(context: ApiContext, campaign_id: str) -> LiveUsers:
    """409 unless the campaign takes live users now."""
    record = require(context, campaign_id)
    if record.user_source != "live":
        detail = (
            f'the users of campaign {campaign_id} come from "{record.user_source}"; only source = "live" takes them'
        )
        raise Problem(409, detail)
    state = state_of(context, record)
    if state in TERMINAL:
        context.live.forget(campaign_id)
        raise Problem(409, f"campaign {campaign_id} is {state}", state=state)
    return context.live.users(campaign_id, context.catalog.mission(record))
