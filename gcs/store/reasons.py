"""What is kept of why a policy chose: bounded, rounded to what people read, and nothing that does not fit. Pure.

A policy may be a service of another make, so nothing of what it tells is taken for granted: what does not fit is left
out, never guessed. The page is shown the same in flight and in a replay, because both read what this leaves.
"""

import logging
import math
from collections.abc import Iterable, Mapping
from typing import Any, TypeGuard

from pydantic import TypeAdapter, ValidationError

logger = logging.getLogger(__name__)

MAX_ENTRIES = 256  # of any list that is told; a MAVLink network has at most 250 vehicles
MAX_ALTERNATIVES = 8  # of a UAV, the best ones
MAX_RELATIONS = 8  # of a UAV, as told: greatest first
MAX_WAY = 24  # ends of slots on a planned way
METRE_DIGITS, PRICE_DIGITS, WEIGHT_DIGITS = 1, 4, 4
FAILED, WIPED = "failed", "wiped"  # keys that say why something is not there
_PAIRS = TypeAdapter(list[tuple[float, float]])


def kept_reasons(told: Mapping[str, Any]) -> dict[str, Any]:
    """Of ``Decision.explanation``; less than 2 kB of JSON a UAV, whatever is told.

    A policy whose reasons cannot be worked out leaves ``{"failed": why}``: the decision itself is kept.
    """
    try:
        return _kept(told)
    except Exception as error:  # a policy is foreign code: whatever it raises, its decision is flown and recorded
        logger.exception("a policy's reasons could not be worked out")
        return {FAILED: f"{type(error).__name__}: {error}"[:200]}


def without_users(kept: Mapping[str, Any]) -> dict[str, Any]:
    """Without whom a UAV attended to and where they were expected: what a place could be read from."""
    if not any(uav["relations"] for uav in kept.get("uavs", ())):
        return dict(kept)
    return {**kept, "uavs": [{**uav, "relations": []} for uav in kept["uavs"]], WIPED: True}


def _kept(told: Mapping[str, Any]) -> dict[str, Any]:
    head = {name: number(told.get(name)) for name in ("horizon_slots", "value", "predicted_gain")}
    by_uav = {entry["uav"]: entry for entry in _entries(told.get("uavs")) if _is_index(entry.get("uav"))}
    attended = dict(enumerate(_list(told.get("relations"))))
    expected = _list(told.get("predicted_user_enu_m"), None)
    related = {uav: _relations(rows, expected) for uav, rows in attended.items()}
    uavs = [
        {
            "uav": uav,
            "path_m": _pairs(by_uav.get(uav, {}).get("path_enu_m"))[:MAX_WAY],
            "alternatives": _alternatives(by_uav.get(uav, {}).get("alternatives")),
            "relations": related.get(uav, []),
        }
        for uav in sorted({*by_uav, *(uav for uav, rows in related.items() if rows)})
    ]
    return {**head, "uavs": uavs}


def _alternatives(told: Any) -> list[dict[str, float]]:
    names = ("heading_deg", "speed_mps", "value", "worse_by")
    rows = [{name: number(entry.get(name)) for name in names} for entry in _entries(told)]
    whole = [{name: value for name, value in row.items() if value is not None} for row in rows]
    fitting = sorted((row for row in whole if len(row) == len(names)), key=lambda row: row["worse_by"])
    return [{name: round(value, PRICE_DIGITS) for name, value in row.items()} for row in fitting[:MAX_ALTERNATIVES]]


def _relations(told: Any, expected: list[Any]) -> list[dict[str, Any]]:
    """``user`` is the row in the slot's users; ``expected_m`` where he was expected at the slot's end, or None."""
    rows = [(entry.get("user"), number(entry.get("weight"))) for entry in _entries(told)]
    return [
        {"user": user, "weight": round(weight, WEIGHT_DIGITS), "expected_m": _place(expected, user)}
        for user, weight in rows
        if _is_index(user) and weight is not None
    ][:MAX_RELATIONS]


def _place(expected: list[Any], user: int) -> tuple[float, float] | None:
    pairs = _pairs(expected[user : user + 1])
    return pairs[0] if pairs else None


def _pairs(told: Any) -> list[tuple[float, float]]:
    try:
        pairs = _PAIRS.validate_python(_list(told))
    except ValidationError:
        return []
    if not all(math.isfinite(value) for pair in pairs for value in pair):
        return []
    return [(round(east, METRE_DIGITS), round(north, METRE_DIGITS)) for east, north in pairs]


def _entries(told: Any) -> Iterable[Mapping[str, Any]]:
    return [entry for entry in _list(told) if isinstance(entry, Mapping)]


def _list(told: Any, most: int | None = MAX_ENTRIES) -> list[Any]:
    return list(told)[:most] if isinstance(told, list | tuple) else []


def _is_index(told: Any) -> TypeGuard[int]:
    return isinstance(told, int) and not isinstance(told, bool) and 0 <= told < 2**31


def number(told: Any) -> float | None:
    """A finite number, or None."""
    if isinstance(told, bool) or not isinstance(told, int | float):
        return None
    try:
        value = float(told)
    except OverflowError:
        return None
    return value if math.isfinite(value) else None
