"""Why the policy chose this, for people: of the newest decision, and of those that a recording holds. Pure."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

from pydantic import ValidationError

from gcs.api.bodies import View
from gcs.ports import CampaignSnapshot, DecisionRecord
from gcs.store.reasons import FAILED, WIPED, kept_reasons, number

Place = tuple[float, float]


class AlternativeView(View):
    """A move that was considered for this slot; ``worse_by`` in the price's own unit, 0 for as good."""

    heading_deg: float
    speed_mps: float
    value: float
    worse_by: float


class RelationView(View):
    """How much this UAV attends to a user (Eq. 11d), greatest first; ``expected_m``: the forecast of the slot's end."""

    user_id: str
    weight: float
    expected_m: Place | None


class UavExplanation(View):
    """One UAV's share of the decision; lists are empty where the policy does not tell."""

    system_id: int
    path_m: list[Place]  # planned: ends of this slot and the next ones
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


class RecordedRelation(View):
    """As :class:`RelationView`; ``user`` is a row of the slot's users, so that who was wiped there has no name here."""

    user: int
    weight: float
    expected_m: Place | None


class RecordedReasons(View):
    """One UAV's share of a recorded decision; ``uav`` is a row of the slot's UAVs."""

    uav: int
    path_m: list[Place]
    alternatives: list[AlternativeView]
    relations: list[RecordedRelation]


class RecordedDecision(View):
    """A decision that was flown, and what the policy told beside it then."""

    at_s: float
    slot: int
    duration_ms: float | None
    moves: list[tuple[float, float]]  # heading in degrees, speed in m/s, a row a UAV
    # unknown: by a version that kept none; failed: could not be worked out; wiped: without users, as their places were
    told: Literal["reasons", "unknown", "failed", "wiped"]
    note: str  # why it failed
    value: float | None
    predicted_gain: float | None
    horizon_slots: int | None
    uavs: list[RecordedReasons]


class ExplanationsPage(View):
    """Some decisions; ask again with ``first=next_first`` while that is not null."""

    decisions: list[RecordedDecision]
    next_first: int | None


def explanation_view(campaign: CampaignSnapshot) -> ExplanationView:
    """``explanation`` with indices turned into names: UAV u and user m are those of the newest slot record."""
    kept = kept_reasons(campaign.explanation)
    latest = campaign.latest
    system_ids = [uav.system_id for uav in latest.uavs] if latest else []
    user_ids = [user.user_id for user in latest.users] if latest else []
    by_uav = {one.uav: one for one in _reasons(kept)}
    return ExplanationView(
        campaign_id=campaign.campaign_id,
        policy=campaign.policy,
        slot=campaign.slot,
        **_head(kept),
        uavs=[_named(system_id, by_uav.get(index), user_ids) for index, system_id in enumerate(system_ids)],
    )


def recorded_decision_view(at_s: float, record: DecisionRecord) -> RecordedDecision:
    """What is not as this version keeps it is unknown: a file may have come from anywhere."""
    kept = record.explanation
    try:
        uavs, head, told = _reasons(kept or {}), _head(kept or {}), _told(kept)
    except (ValidationError, TypeError, ValueError):
        uavs, head, told = [], _head({}), "unknown"
    return RecordedDecision(
        at_s=at_s,
        slot=record.slot,
        duration_ms=record.duration_ms,
        moves=[
            (round(_degrees(heading), 1), round(speed, 2))
            for heading, speed in zip(record.heading_rad, record.speed_mps, strict=True)
        ],
        told=told,
        note=str((kept or {}).get(FAILED, "")),
        **head,
        uavs=uavs,
    )


def _told(kept: Mapping[str, Any] | None) -> Literal["reasons", "unknown", "failed", "wiped"]:
    if kept is None:
        return "unknown"
    return "failed" if FAILED in kept else "wiped" if WIPED in kept else "reasons"


def _head(kept: Mapping[str, Any]) -> dict[str, Any]:
    value, gain, horizon = (number(kept.get(name)) for name in ("value", "predicted_gain", "horizon_slots"))
    return {"value": value, "predicted_gain": gain, "horizon_slots": None if horizon is None else int(horizon)}


def _reasons(kept: Mapping[str, Any]) -> list[RecordedReasons]:
    return [RecordedReasons.model_validate(uav) for uav in kept.get("uavs", ())]


def _named(system_id: int, told: RecordedReasons | None, user_ids: Sequence[str]) -> UavExplanation:
    if told is None:
        return UavExplanation(system_id=system_id, path_m=[], alternatives=[], relations=[])
    relations = [
        RelationView(user_id=user_ids[one.user], weight=one.weight, expected_m=one.expected_m)
        for one in told.relations
        if one.user < len(user_ids)
    ]
    return UavExplanation(system_id=system_id, path_m=told.path_m, alternatives=told.alternatives, relations=relations)


def _degrees(heading_rad: float) -> float:
    return math.degrees(heading_rad) % 360.0
