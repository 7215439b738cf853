"""Why the policy chose this: whatever a policy tells, brought into one shape for people to look at. Pure.

A policy may be a service of another make, so nothing of what it tells is taken for granted: what does not fit is left
out, never guessed.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from pydantic import TypeAdapter, ValidationError

from gcs.api.bodies import View
from gcs.ports import CampaignSnapshot

MAX_ENTRIES = 256  # of a list; a MAVLink network has at most 250 vehicles
_PAIRS = TypeAdapter(list[tuple[float, float]])


class AlternativeView(View):
    """A move that was considered for this slot; ``worse_by`` in the price's own unit, 0 for as good."""

    heading_deg: float
    speed_mps: float
    value: float
    worse_by: float


class RelationView(View):
    """How much this UAV attends to a user (Eq. 11d), greatest first."""

    user_id: str
    weight: float


class UavExplanation(View):
    """One UAV's share of the decision; lists are empty where the policy does not tell."""

    system_id: int
    path_m: list[tuple[float, float]]  # planned: ends of this slot and the next ones
    alternatives: list[AlternativeView]
    relations: list[RelationView]


class ExplanationView(View):
    """The newest decision. ``value``: the plan's price (lower is better), None where the policy has none."""

    campaign_id: str
    policy: str
    slot: int
    value: float | None
    predicted_gain: float | None  # on the plan kept from the slot before
    horizon_slots: int | None
    uavs: list[UavExplanation]


def explanation_view(campaign: CampaignSnapshot) -> ExplanationView:
    """``explanation`` with indices turned into names: UAV u and user m are those of the newest slot record."""
    told = campaign.explanation
    latest = campaign.latest
    system_ids = [uav.system_id for uav in latest.uavs] if latest else []
    user_ids = [user.user_id for user in latest.users] if latest else []
    by_uav = {entry["uav"]: entry for entry in _entries(told.get("uavs")) if isinstance(entry.get("uav"), int)}
    relations = _list(told.get("relations"))
    horizon = _number(told.get("horizon_slots"))
    return ExplanationView(
        campaign_id=campaign.campaign_id,
        policy=campaign.policy,
        slot=campaign.slot,
        value=_number(told.get("value")),
        predicted_gain=_number(told.get("predicted_gain")),
        horizon_slots=None if horizon is None else int(horizon),
        uavs=[
            UavExplanation(
                system_id=system_id,
                path_m=_pairs(by_uav.get(index, {}).get("path_enu_m")),
                alternatives=_alternatives(by_uav.get(index, {}).get("alternatives")),
                relations=_relations(relations[index] if index < len(relations) else None, user_ids),
            )
            for index, system_id in enumerate(system_ids)
        ],
    )


def _alternatives(told: Any) -> list[AlternativeView]:
    names = ("heading_deg", "speed_mps", "value", "worse_by")
    rows = [{name: _number(entry.get(name)) for name in names} for entry in _entries(told)]
    return [AlternativeView.model_validate(row) for row in rows if None not in row.values()]


def _relations(told: Any, user_ids: Sequence[str]) -> list[RelationView]:
    known = [
        (entry.get("user"), weight) for entry in _entries(told) if (weight := _number(entry.get("weight"))) is not None
    ]
    return [
        RelationView(user_id=user_ids[user], weight=weight)
        for user, weight in known
        if isinstance(user, int) and 0 <= user < len(user_ids)
    ]


def _pairs(told: Any) -> list[tuple[float, float]]:
    try:
        pairs = _PAIRS.validate_python(_list(told))
    except ValidationError:
        return []
    return pairs if all(math.isfinite(value) for pair in pairs for value in pair) else []


def _entries(told: Any) -> Iterable[Mapping[str, Any]]:
    return [entry for entry in _list(told) if isinstance(entry, Mapping)]


def _list(told: Any) -> list[Any]:
    return list(told)[:MAX_ENTRIES] if isinstance(told, list | tuple) else []


def _number(told: Any) -> float | None:
    if isinstance(told, bool) or not isinstance(told, int | float):
        return None
    return float(told) if math.isfinite(told) else None
