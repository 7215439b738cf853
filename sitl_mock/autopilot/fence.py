"""Geofence: how far the vehicle may go, from the parameters and from the uploaded fence items.

https://mavlink.io/en/services/mission.html#fence: polygon corners (5001 stay in, 5002 stay out, param1 their number)
and circles (5003, 5004, param1 the radius).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from math import hypot
from typing import TYPE_CHECKING

from sitl_mock.autopilot.constants import Severity
from sitl_mock.autopilot.missions import FENCE, Item
from sitl_mock.autopilot.modes import Behaviour
from sitl_mock.geodesy import Geodetic, to_ned_m

if TYPE_CHECKING:
    from sitl_mock.autopilot.state import Vehicle

_CORNER_IN, _CORNER_OUT, _CIRCLE_IN, _CIRCLE_OUT = 5001, 5002, 5003, 5004  # MAV_CMD_NAV_FENCE_*
_LANDING = {Behaviour.LAND, Behaviour.RTL}
Point = tuple[float, float]


class Breach(IntEnum):
    """FENCE_BREACH."""

    NONE = 0
    MAX_ALT = 2
    BOUNDARY = 3


@dataclass(frozen=True, slots=True)
class FenceRule:
    """Limits and what follows a breach; a limit of 0 is off."""

    enabled: bool
    max_alt_m: float  # above home
    max_distance_m: float  # from home
    polygons: bool  # whether uploaded items count
    mode: str | None  # None warns only
    terminates: bool = False


@dataclass(frozen=True, slots=True)
class Zone:
    """One uploaded fence: corners, or one centre and a radius; metres NE from the pad."""

    corners: tuple[Point, ...]
    radius_m: float
    inside_is_good: bool

    def allows(self, north_m: float, east_m: float) -> bool:
        """Whether a vehicle may be there."""
        if self.radius_m > 0.0:
            (centre,) = self.corners
            inside = hypot(north_m - centre[0], east_m - centre[1]) <= self.radius_m
        else:
            inside = _within(self.corners, north_m, east_m)
        return inside == self.inside_is_good


@dataclass(slots=True)
class FenceState:
    """What has been breached so far."""

    breach: Breach = Breach.NONE
    count: int = 0
    at_s: float = 0.0
    zones: tuple[Zone, ...] = ()
    read_from: tuple[Item, ...] = ()


def _within(corners: tuple[Point, ...], north: float, east: float) -> bool:
    """Even-odd rule."""
    inside = False
    for (n1, e1), (n2, e2) in zip(corners, corners[1:] + corners[:1], strict=True):
        if (e1 > east) != (e2 > east) and north < n1 + (east - e1) / (e2 - e1) * (n2 - n1):
            inside = not inside
    return inside


def zones(vehicle: Vehicle) -> tuple[Zone, ...]:
    """The uploaded fences; corners whose number does not fit are no fence."""
    items = tuple(vehicle.missions.plans[FENCE])
    state = vehicle.fence
    if items != state.read_from:
        state.read_from, state.zones = items, tuple(_read(vehicle, items))
    return state.zones


def _read(vehicle: Vehicle, items: tuple[Item, ...]) -> list[Zone]:
    found: list[Zone] = []
    at = 0
    while at < len(items):
        item, taken = items[at], 1
        if item.command in (_CIRCLE_IN, _CIRCLE_OUT) and item.params[0] > 0:
            found.append(Zone((_point(vehicle, item),), item.params[0], item.command == _CIRCLE_IN))
        elif item.command in (_CORNER_IN, _CORNER_OUT) and item.params[0] >= 3:
            taken = min(int(item.params[0]), len(items) - at)
            group = items[at : at + taken]
            if all(other.command == item.command for other in group) and taken >= 3:
                corners = tuple(_point(vehicle, other) for other in group)
                found.append(Zone(corners, 0.0, item.command == _CORNER_IN))
        at += taken
    return found


def _point(vehicle: Vehicle, item: Item) -> Point:
    north, east, _ = to_ned_m(vehicle.body.pad, Geodetic(item.x / 1e7, item.y / 1e7, vehicle.body.pad.alt_amsl_m))
    return north, east


def breach(vehicle: Vehicle, rule: FenceRule) -> Breach:
    """What the vehicle oversteps now."""
    north, east, _ = vehicle.body.pos_ned_m
    home = vehicle.home_ned_m
    if 0.0 < rule.max_alt_m < vehicle.alt_home_m:
        return Breach.MAX_ALT
    if 0.0 < rule.max_distance_m < hypot(north - home[0], east - home[1]):
        return Breach.BOUNDARY
    if rule.polygons and not all(zone.allows(north, east) for zone in zones(vehicle)):
        return Breach.BOUNDARY
    return Breach.NONE


def check(vehicle: Vehicle) -> None:
    """A new breach is told and acted on once; coming back in clears it."""
    rule = vehicle.flavour.fence_rule(vehicle.params)
    if not rule.enabled:
        vehicle.fence.breach = Breach.NONE
        return
    if not vehicle.flying:
        return
    found, state = breach(vehicle, rule), vehicle.fence
    new = found is not Breach.NONE and state.breach is Breach.NONE
    state.breach = found
    if new:
        state.count, state.at_s = state.count + 1, vehicle.now_s
        vehicle.say(Severity.WARNING if vehicle.flavour.name == "px4" else Severity.NOTICE, _text(vehicle, found))
        _act(vehicle, rule)


def _text(vehicle: Vehicle, found: Breach) -> str:
    if vehicle.flavour.name == "ardupilot":
        return "Fence Breached"  # ArduCopter/fence.cpp, 4.5
    return "Geofence violation: " + ("above max altitude" if found is Breach.MAX_ALT else "outside")


def _act(vehicle: Vehicle, rule: FenceRule) -> None:
    if rule.terminates:
        vehicle.disarm("Flight termination: geofence")
        return
    mode = vehicle.flavour.modes.by_name(rule.mode) if rule.mode else None
    if mode is not None and vehicle.armed and vehicle.mode.behaviour not in _LANDING:
        vehicle.enter(mode)
