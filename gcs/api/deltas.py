"""What changed between two snapshots told to one client, rounded to what a page can show. Pure.

A fleet in motion changes little of what is known about it: with 100 vehicles and 2,000 users at 5 Hz whole snapshots
are some 800 kB/s, changes with sensible digits 120 kB/s (``tests/api/test_deltas.py`` measures).
"""

from collections.abc import Sequence
from typing import Any

from gcs.api.schemas import DeltaMessage, PlanView, SnapshotMessage, UserView

Json = dict[str, Any]
OTHER_DIGITS = 2
DIGITS = {"lat_deg": 7, "lon_deg": 7} | dict.fromkeys(  # 1 cm
    ("metrics", "yaw_rad", "loss_ratio", "battery_fraction", "setpoint_period_s"), 4
)

_SCALES = tuple(10.0**digits for digits in range(8))
_MOST = 1e15  # beyond it a float has no decimals left to lose


def told(message: SnapshotMessage, plans: list[Json] | None = None) -> Json:
    """A snapshot as a client that takes deltas knows it: rounded, and without the explanation, which has a route.

    ``plans``: the campaign's plans as :func:`plans_told` has them, where they have been made before.
    """
    whole = message.model_dump(mode="json", exclude={"campaign": {"plans", "explanation"}})
    _round_all(whole, OTHER_DIGITS)
    if message.campaign is not None:
        whole["campaign"] |= {"plans": plans_told(message.campaign.plans) if plans is None else plans}
        whole["campaign"] |= {"explanation": {}}
    return whole


def plans_told(plans: Sequence[PlanView]) -> list[Json]:
    """Rounded."""
    return _made(plans)


def users_told(users: Sequence[UserView]) -> list[Json]:
    """Rounded."""
    return _made(users)


def _made(views: Sequence[PlanView | UserView]) -> list[Json]:
    made = [view.model_dump(mode="json") for view in views]
    _round_list(made, OTHER_DIGITS)
    return made


def delta(before: Json | None, now: Json) -> DeltaMessage | None:
    """What turns ``before`` into ``now``; None when it takes a whole snapshot, as for another fleet or campaign."""
    if before is None or _identity(before) != _identity(now):
        return None
    vehicles = [
        {"system_id": new["system_id"]} | _changed(old, new)
        for old, new in zip(before["vehicles"], now["vehicles"], strict=True)
    ]
    campaign = _changed(before["campaign"] or {}, now["campaign"] or {})
    if campaign.get("users", 0) is None:  # not told again is not a change
        del campaign["users"]
    apart = {"type", "vehicles", "campaign"}
    changed = {name: value for name, value in _changed(before, now).items() if name not in apart}
    return DeltaMessage(changed=changed, vehicles=[one for one in vehicles if len(one) > 1], campaign=campaign)


def _identity(whole: Json) -> tuple[Any, ...]:
    campaign = whole["campaign"]
    return (campaign and campaign["campaign_id"], *(one["system_id"] for one in whole["vehicles"]))


def _changed(before: Json, now: Json) -> Json:
    return {name: value for name, value in now.items() if name not in before or before[name] != value}


def _round_all(whole: Json, digits: int) -> None:
    """In place, since it is a fresh copy: thousands of numbers ten times a second."""
    for name, value in whole.items():
        kind = type(value)
        if kind is float:
            whole[name] = _rounded(value, DIGITS.get(name, digits))
        elif kind is list:
            _round_list(value, DIGITS.get(name, digits))
        elif kind is dict:
            _round_all(value, DIGITS.get(name, digits))


def _round_list(values: list[Any], digits: int) -> None:
    for place, value in enumerate(values):
        kind = type(value)
        if kind is float:
            values[place] = _rounded(value, digits)
        elif kind is list:
            _round_list(value, digits)
        elif kind is dict:
            _round_all(value, digits)


def _rounded(value: float, digits: int) -> float:
    """To the nearest decimal; a quarter of the time of ``round(value, digits)``. What is no number stays as it is."""
    scale = _SCALES[digits]
    scaled = value * scale
    return round(scaled) / scale if -_MOST < scaled < _MOST else value
