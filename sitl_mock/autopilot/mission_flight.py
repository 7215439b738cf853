"""The flight through a stored mission: one item after the other becomes the target."""

from __future__ import annotations

from enum import Enum
from math import dist

from sitl_mock.autopilot.constants import Command
from sitl_mock.autopilot.missions import GLOBAL, MISSION, RELATIVE, Item
from sitl_mock.autopilot.state import Note, PositionTarget, TakeoffTarget, Vehicle
from sitl_mock.geodesy import Geodetic, to_ned_m

_HIGHEST_M = 1e5
_REACHED_M = 2.0  # WPNAV_RADIUS 200 cm
_PLACES = {Command.NAV_WAYPOINT, Command.NAV_TAKEOFF, Command.NAV_LOITER_UNLIM}


class Step(Enum):
    """What the present item makes the vehicle do."""

    FLY = "fly to the target"
    RETURN = "return"
    LAND = "land"


def _place_ned_m(vehicle: Vehicle, item: Item) -> tuple[float, float, float]:
    here = vehicle.body.pos_ned_m
    if not abs(item.z) <= _HIGHEST_M:  # NaN, PX4: the present height
        up_m = vehicle.body.place.alt_amsl_m
    else:
        up_m = item.z + (vehicle.home.alt_amsl_m if item.frame in RELATIVE else 0.0)
    if item.frame not in GLOBAL or (item.x, item.y) == (0, 0):
        return here[0], here[1], vehicle.body.pad.alt_amsl_m - up_m
    return to_ned_m(vehicle.body.pad, Geodetic(item.x / 1e7, item.y / 1e7, up_m))


def current_step(vehicle: Vehicle) -> Step:
    """Sets the target of the present item and moves on when it is reached."""
    plan = vehicle.missions.plans[MISSION]
    while vehicle.mission_item < len(plan):
        item = plan[vehicle.mission_item]
        if item.command == Command.NAV_RETURN_TO_LAUNCH:
            return Step.RETURN
        if item.command == Command.NAV_LAND:
            return Step.LAND
        if item.command == Command.DO_CHANGE_SPEED and item.params[1] > 0:
            vehicle.mission_speed_mps = item.params[1]
        elif item.command in _PLACES and not _is_home(vehicle, item):
            if not _arrived(vehicle, item):
                return Step.FLY
            vehicle.notes.append(_reached(vehicle))
        vehicle.mission_item, vehicle.target = vehicle.mission_item + 1, None
    return Step.FLY


def _is_home(vehicle: Vehicle, item: Item) -> bool:
    """ArduPilot keeps home in item 0 and does not fly to it."""
    return vehicle.mission_item == 0 and vehicle.flavour.name == "ardupilot" and item.command == Command.NAV_WAYPOINT


def _arrived(vehicle: Vehicle, item: Item) -> bool:
    """Whether a place is reached; until then it is the target. PX4 takes off by itself where it must."""
    if not vehicle.flying:
        lifts_off = item.command == Command.NAV_TAKEOFF or vehicle.flavour.name == "px4"
        if lifts_off and not isinstance(vehicle.target, TakeoffTarget):
            north, east, _ = vehicle.body.pos_ned_m
            lift_off_s = vehicle.now_s + vehicle.flavour.takeoff_delay_s
            vehicle.target = TakeoffTarget((north, east, _place_ned_m(vehicle, item)[2]), lift_off_s)
        return False
    target = vehicle.target
    climbed = isinstance(target, TakeoffTarget) and dist(target.pos_ned_m, vehicle.body.pos_ned_m) <= _REACHED_M
    if climbed and item.command == Command.NAV_TAKEOFF:
        return True
    if climbed or not isinstance(target, PositionTarget | TakeoffTarget):
        target = vehicle.target = PositionTarget(_place_ned_m(vehicle, item), None, vehicle.mission_speed_mps)
    near = dist(target.pos_ned_m, vehicle.body.pos_ned_m) <= _REACHED_M
    return near and item.command != Command.NAV_LOITER_UNLIM


def _reached(vehicle: Vehicle) -> Note:
    return Note(None, "MISSION_ITEM_REACHED", {"seq": vehicle.mission_item})
