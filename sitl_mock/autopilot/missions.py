"""Mission, fence and rally storage with its transfer protocol.

https://mavlink.io/en/services/mission.html: items are asked for one by one, again after 250 ms, 5 times.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from math import isnan
from typing import TYPE_CHECKING, Any

from sitl_mock.autopilot.constants import Frame

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sitl_mock.autopilot.state import Vehicle
    from sitl_mock.wire import Frame as Message

MISSION, FENCE, RALLY = 0, 1, 2  # MAV_MISSION_TYPE
_ALL = 255
_MAX_ITEMS = 700
_RETRY_S, _RETRIES = 0.25, 5
RELATIVE = {Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT}
GLOBAL = RELATIVE | {Frame.GLOBAL, Frame.GLOBAL_INT}


class Outcome(IntEnum):
    """MAV_MISSION_RESULT."""

    ACCEPTED = 0
    ERROR = 1
    NO_SPACE = 4
    INVALID_PARAM5_X = 10
    INVALID_SEQUENCE = 13
    CANCELLED = 15


@dataclass(frozen=True, slots=True)
class Item:
    """One stored item; x, y in degrees times 1e7 for global frames."""

    command: int
    frame: int
    params: tuple[float, float, float, float]
    x: int
    y: int
    z: float
    autocontinue: int


@dataclass(slots=True)
class _Upload:
    """A transfer from the ground under way."""

    kind: int
    count: int
    peer: int
    system: int
    component: int
    items: list[Item]
    asked_s: float
    tries: int = 1


@dataclass(slots=True)
class Store:
    """What is stored and what is being transferred."""

    plans: dict[int, list[Item]] = field(default_factory=lambda: {MISSION: [], FENCE: [], RALLY: []})
    upload: _Upload | None = None


def _item(values: Mapping[str, Any], *, is_int: bool) -> Item | None:
    """The item received, None if its place is none on the globe."""
    params = (values["param1"], values["param2"], values["param3"], values["param4"])
    scale = 1 if is_int else 1e7
    x, y = values["x"] * scale, values["y"] * scale
    if isnan(x) or isnan(y):  # PX4: the present place
        x = y = 0
    on_globe = abs(x) <= 90e7 and abs(y) <= 180e7
    if not (on_globe if values["frame"] in GLOBAL else max(abs(x), abs(y)) < 2**31):
        return None
    north, east = round(x), round(y)
    return Item(values["command"], values["frame"], params, north, east, values["z"], values["autocontinue"])


def receive(vehicle: Vehicle, message: Message, peer: int) -> None:
    """Any message of the mission protocol."""
    kind = message.values.get("mission_type", MISSION)
    store = vehicle.missions
    handled = {
        "MISSION_COUNT": _count,
        "MISSION_ITEM_INT": _received,
        "MISSION_ITEM": _received,
        "MISSION_REQUEST_INT": _requested,
        "MISSION_REQUEST": _requested,
        "MISSION_REQUEST_LIST": _listed,
        "MISSION_CLEAR_ALL": _cleared,
    }
    if message.name == "MISSION_SET_CURRENT":
        if message["seq"] < len(store.plans[MISSION]):
            vehicle.mission_item, vehicle.target = message["seq"], None
        vehicle.reply(peer, "MISSION_CURRENT", seq=vehicle.mission_item)
    elif message.name in handled and (kind in store.plans or kind == _ALL):
        handled[message.name](vehicle, message, peer, kind)


def _ack(vehicle: Vehicle, to: tuple[int, int, int], outcome: Outcome, kind: int) -> None:
    peer, system, component = to
    vehicle.reply(
        peer,
        "MISSION_ACK",
        target_system=system,
        target_component=component,
        type=int(outcome),
        mission_type=kind,
    )


def _sender(message: Message, peer: int) -> tuple[int, int, int]:
    return peer, message.system, message.component


def _count(vehicle: Vehicle, message: Message, peer: int, kind: int) -> None:
    count = message["count"]
    if count > _MAX_ITEMS or kind == _ALL:
        _ack(vehicle, _sender(message, peer), Outcome.NO_SPACE, kind)
    elif count == 0:
        _cleared(vehicle, message, peer, kind)
    else:
        upload = _Upload(kind, count, peer, message.system, message.component, [], vehicle.now_s)
        vehicle.missions.upload = upload
        _ask(vehicle, upload)


def _ask(vehicle: Vehicle, upload: _Upload) -> None:
    upload.asked_s = vehicle.now_s
    vehicle.reply(
        upload.peer,
        "MISSION_REQUEST_INT",
        target_system=upload.system,
        target_component=upload.component,
        seq=len(upload.items),
        mission_type=upload.kind,
    )


def _received(vehicle: Vehicle, message: Message, peer: int, kind: int) -> None:
    upload = vehicle.missions.upload
    if upload is None or (upload.kind, upload.system) != (kind, message.system):
        _ack(vehicle, _sender(message, peer), Outcome.ERROR, kind)
        return
    if message["seq"] != len(upload.items):
        return  # a repeated item; the one that is missing has been asked for
    item = _item(message.values, is_int=message.name == "MISSION_ITEM_INT")
    if item is None:
        vehicle.missions.upload = None
        _ack(vehicle, _sender(message, peer), Outcome.INVALID_PARAM5_X, kind)
        return
    upload.items.append(item)
    upload.tries = 1
    if len(upload.items) < upload.count:
        _ask(vehicle, upload)
        return
    vehicle.missions.plans[kind] = upload.items
    vehicle.missions.upload = None
    if kind == MISSION:
        vehicle.mission_item, vehicle.mission_speed_mps = 0, None
    _ack(vehicle, _sender(message, peer), Outcome.ACCEPTED, kind)


def _listed(vehicle: Vehicle, message: Message, peer: int, kind: int) -> None:
    vehicle.reply(
        peer,
        "MISSION_COUNT",
        target_system=message.system,
        target_component=message.component,
        count=len(vehicle.missions.plans.get(kind, ())),
        mission_type=kind,
    )


def _requested(vehicle: Vehicle, message: Message, peer: int, kind: int) -> None:
    plan, seq = vehicle.missions.plans.get(kind, []), message["seq"]
    if seq >= len(plan):
        _ack(vehicle, _sender(message, peer), Outcome.INVALID_SEQUENCE, kind)
        return
    item, is_int = plan[seq], message.name == "MISSION_REQUEST_INT"
    p1, p2, p3, p4 = item.params
    vehicle.reply(
        peer,
        "MISSION_ITEM_INT" if is_int else "MISSION_ITEM",
        target_system=message.system,
        target_component=message.component,
        seq=seq,
        frame=item.frame,
        command=item.command,
        current=int(seq == vehicle.mission_item),
        autocontinue=item.autocontinue,
        param1=p1,
        param2=p2,
        param3=p3,
        param4=p4,
        x=item.x if is_int else item.x / 1e7,
        y=item.y if is_int else item.y / 1e7,
        z=item.z,
        mission_type=kind,
    )


def _cleared(vehicle: Vehicle, message: Message, peer: int, kind: int) -> None:
    for each in vehicle.missions.plans if kind == _ALL else (kind,):
        vehicle.missions.plans[each] = []
    _ack(vehicle, _sender(message, peer), Outcome.ACCEPTED, kind)


def tick(vehicle: Vehicle) -> None:
    """Asks again for an item that did not come, gives up after the retries."""
    upload = vehicle.missions.upload
    if upload is None or vehicle.now_s - upload.asked_s < _RETRY_S:
        return
    if upload.tries > _RETRIES:
        vehicle.missions.upload = None
        to = (upload.peer, upload.system, upload.component)
        _ack(vehicle, to, Outcome.CANCELLED, upload.kind)
        return
    upload.tries += 1
    _ask(vehicle, upload)


def stored(vehicle: Vehicle) -> bool:
    """Whether there is a mission to fly."""
    return bool(vehicle.missions.plans[MISSION])
