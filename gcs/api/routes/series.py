"""What the page's curves and forms need beside the full report: small however many users there are."""

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter, Path

from gcs.api.context import Context
from gcs.api.dry_run_views import SeriesPoint
from gcs.api.problems import Problem
from gcs.api.routes.campaigns import CampaignId, require
from gcs.api.views import metrics_view
from gcs.ports import SlotRecord
from gcs.store.jsonable import jsonable
from policy.mission_file import MissionError, list_missions, load_mission

router = APIRouter()
MissionName = Annotated[str, Path(min_length=1, max_length=64, pattern="^[A-Za-z0-9_.-]+$")]


@router.get("/campaigns/{campaign_id}/series", tags=["campaigns"])
def series(campaign_id: CampaignId, context: Context) -> list[SeriesPoint]:
    """A point a finished slot; ``/report`` has every user of every slot."""
    require(context, campaign_id)
    return [point for point in map(_point, context.store.slots.of(campaign_id)) if point is not None]


@router.get("/missions/{name}", tags=["shelf"])
def mission_document(name: MissionName) -> dict[str, Any]:
    """A mission at hand as a document, to change and to POST as a campaign."""
    path = list_missions().get(name)
    if path is None:
        raise Problem(404, f"there is no mission {name}; GET /api/v1/missions lists them")
    try:
        document: dict[str, Any] = jsonable(dict(load_mission(path).document))
    except MissionError as error:
        raise Problem(409, str(error).replace(f"{path}", path.name)) from None
    return document


def _point(record: SlotRecord) -> SeriesPoint | None:
    metrics = metrics_view(record.metrics)
    if metrics is None:
        return None
    mean = float(np.mean([user.aoi_slots for user in record.users])) if record.users else None
    return SeriesPoint(slot=record.slot, metrics=metrics, mean_aoi_slots=mean, decision_ms=record.decision_ms)
