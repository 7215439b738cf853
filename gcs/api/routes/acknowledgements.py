"""Alerts acknowledged by name: told to every page, and kept in the audit log."""

from typing import Annotated

from fastapi import APIRouter
from pydantic import Field

from gcs.api.bodies import Body, View
from gcs.api.context import ApiContext, Context, Who
from gcs.api.problems import Problem
from gcs.ports import Event, Severity

router = APIRouter(tags=["events"])
KIND = "alert.acknowledged"


class AlertBody(Body):
    """Which event of the stream; its time guards against another server's numbers."""

    sequence: Annotated[int, Field(ge=1, le=2**53)]
    time_s: Annotated[float, Field(allow_inf_nan=False)]


class Acknowledged(View):
    """By whom."""

    sequence: int
    by: str


@router.post("/acknowledgements", status_code=201)
def acknowledge(body: AlertBody, context: Context, who: Who) -> Acknowledged:
    """Take note of a warning or caution in one's own name; once is enough, a second time changes nothing."""
    event = _event(context, body)
    already = _acknowledged_by(context, body.sequence)
    if already is None:
        message = f'"{event.message}" acknowledged'
        data = {"sequence": body.sequence}
        context.audit(who.name, KIND, message, campaign_id=event.campaign_id, system_id=event.system_id, data=data)
    return Acknowledged(sequence=body.sequence, by=already or who.name)


def _event(context: ApiContext, body: AlertBody) -> Event:
    found = context.store.tail.since(body.sequence - 1, 1)
    if not found or found[0].sequence != body.sequence or abs(found[0].event.time_s - body.time_s) > 1e-3:
        raise Problem(404, f"there is no event {body.sequence} of this time any more; GET /api/v1/events has the log")
    if found[0].event.severity is Severity.INFO:
        raise Problem(409, f"event {body.sequence} is no alert: there is nothing to acknowledge")
    return found[0].event


def _acknowledged_by(context: ApiContext, sequence: int) -> str | None:
    later = context.store.tail.since(sequence)
    return next((n.event.actor for n in later if n.event.kind == KIND and n.event.data["sequence"] == sequence), None)
