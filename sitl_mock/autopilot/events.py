"""PX4's events (https://mavlink.io/en/services/events.html): numbered, and sent again to who missed one."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sitl_mock.autopilot.constants import AUTOPILOT_COMPONENT, Severity

if TYPE_CHECKING:
    from sitl_mock.autopilot.state import Vehicle
    from sitl_mock.wire import Frame

_KEPT = 16
_FNV_START, _FNV_PRIME = 0x811C9DC5, 0x01000193


def event_id(name: str) -> int:
    """FNV-1a of the name in 24 bits under the component (PX4 events::ID, libevents)."""
    value = _FNV_START
    for byte in name.encode():
        value = ((value ^ byte) * _FNV_PRIME) & 0xFFFFFFFF
    return AUTOPILOT_COMPONENT << 24 | value & 0xFFFFFF


@dataclass(slots=True)
class Events:
    """What was told lately."""

    sequence: int = 0
    told: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=_KEPT))


def tell(vehicle: Vehicle, name: str, severity: Severity = Severity.INFO) -> None:
    """Sends an event to everybody. ArduPilot has none."""
    if vehicle.flavour.name != "px4":
        return
    events = vehicle.events
    events.sequence = (events.sequence + 1) & 0xFFFF
    values = {
        "id": event_id(name),
        "event_time_boot_ms": round(vehicle.clock_s * 1000),
        "sequence": events.sequence,
        "log_levels": int(severity) << 4 | int(severity),
        "arguments": (0,) * 40,
    }
    events.told.append(values)
    vehicle.tell(None, "EVENT", values)


def requested(vehicle: Vehicle, frame: Frame, peer: int) -> None:
    """REQUEST_EVENT: those from first to last again, an error for each that is gone."""
    if vehicle.flavour.name != "px4":
        return
    kept = {values["sequence"]: values for values in vehicle.events.told}
    to = {"target_system": frame.system, "target_component": frame.component}
    first, last = frame["first_sequence"], frame["last_sequence"]
    for number in range(min((last - first) & 0xFFFF, 2 * _KEPT) + 1):
        sequence = (first + number) & 0xFFFF
        if sequence in kept:
            vehicle.tell(peer, "EVENT", kept[sequence])
            continue
        oldest = next(iter(kept), vehicle.events.sequence)
        vehicle.tell(peer, "RESPONSE_EVENT_ERROR", {"sequence": sequence, "sequence_oldest_available": oldest} | to)
