"""A decision as JSON: in the store's rows, in exports and in reports. Pure: a flight needs no database for it."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from typing import Any

from gcs.ports import DecisionRecord
from gcs.store.jsonable import jsonable
from gcs.store.reasons import kept_reasons, without_users

DECISIONS_FILE = "decisions.json"  # in a report's folder, for `gcs replay`


def decision_document(record: DecisionRecord) -> dict[str, Any]:
    """All that it was made from, and why: reasons that nobody has asked for are worked out now."""
    document: dict[str, Any] = jsonable(asdict(replace(record, explanation=None)))
    if record.explanation is not None:
        document["explanation"] = jsonable(kept_reasons(record.explanation))
    return document


def recorded_decision(document: Mapping[str, Any]) -> DecisionRecord:
    """A decision as stored; JSON keeps every bit of a double.

    Raises KeyError, TypeError, ValueError for what is none.
    """
    pairs = {name: tuple(map(tuple, document[name])) for name in ("pos_enu_m", "vel_enu_mps")}
    names = ("energy_left_j", "active", "heading_rad", "speed_mps", "end_heading_rad", "end_speed_mps")
    rows = {name: tuple(document[name]) for name in names if document.get(name) is not None}
    users = tuple(
        (math.nan if east is None else east, math.nan if north is None else north, data_mb, aoi, active)
        for east, north, data_mb, aoi, active in document.get("users", ())
    )
    limits = {name: document.get(name, math.nan) for name in ("max_speed_mps", "max_accel_mps2")}
    told = {name: math.inf if value is None else value for name, value in limits.items()}  # JSON has no infinity
    time_s = document.get("time_s")
    known = {"users": users, "time_s": math.nan if time_s is None else float(time_s)}
    return DecisionRecord(**dict(document) | pairs | rows | told | known)


def without_places(document: Mapping[str, Any]) -> dict[str, Any]:
    """Without where users were or were expected, and whom a UAV attended to."""
    users = [[None, None, *rest] for _, _, *rest in document.get("users", ())]
    kept = document.get("explanation")
    return {**document, "users": users} | ({} if kept is None else {"explanation": without_users(kept)})


def decisions_document(records: Iterable[DecisionRecord]) -> list[dict[str, Any]]:
    """For a file, in their order."""
    return [decision_document(record) for record in records]
