"""Why the policy chose what is being flown."""

from fastapi import APIRouter

from gcs.api.context import Context
from gcs.api.explanations import ExplanationView, explanation_view
from gcs.api.problems import Problem
from gcs.api.routes.campaigns import CampaignId, in_flight, require

router = APIRouter(prefix="/campaigns/{campaign_id}", tags=["campaigns"])


@router.get("/explanation")
def explanation(campaign_id: CampaignId, context: Context) -> ExplanationView:
    """Of the newest decision; 404 when the campaign is not the one in the air, or last in the air."""
    flown = in_flight(context, campaign_id)
    if flown is None:
        record = require(context, campaign_id)
        raise Problem(404, f"campaign {record.id} is not in the air: there is no decision to explain")
    return explanation_view(flown)
