"""What changed between two snapshots told to one client, rounded to what a page can show. Pure.

A fleet in motion changes little of what is known about it: with 100 vehicles and 2,000 users at 5 Hz whole snapshots
are some 800 kB/s, changes with sensible digits 120 kB/s (``tests/api/test_deltas.py`` measures).
"""

from typing import Any

from gcs.api.schemas import DeltaMessage, SnapshotMessage

Json = dict[str, Any]
OTHER_DIGITS = 2
DIGITS = {"lat_deg": 7, "lon_deg": 7} | dict.fromkeys(  # 1 cm
    ("metrics", "yaw_rad", "loss_ratio", "battery_fraction", "setpoint_period_s"), 4
)


def told(message: SnapshotMessage) -> Json:
    """A snapshot as a client that takes deltas knows it: rounded, and without the explanation, which has a route."""
    whole = message.model_dump(mode="json")
    if whole["campaign"] is not None:
        whole["campaign"]["explanation"] = {}
    return _rounded(whole)  # type: ignore[no-any-return]


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


def _rounded(value: Any, digits: int = OTHER_DIGITS) -> Any:
    if isinstance(value, float):
        return round(value, digits)
    if isinstance(value, list):
        return [_rounded(one, digits) for one in value]
    if isinstance(value, dict):
        return {name: _rounded(one, DIGITS.get(name, digits)) for name, one in value.items()}
    return value
