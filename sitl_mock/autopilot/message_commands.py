"""Commands that ask for messages: once, or at an interval."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING

from sitl_mock.autopilot import streams
from sitl_mock.autopilot.constants import Command, Result
from sitl_mock.autopilot.orders import DONE, Handler, Order, Verdict
from sitl_mock.autopilot.telemetry import BUILDERS, available, ready
from sitl_mock.wire.definition import BY_ID

if TYPE_CHECKING:
    from sitl_mock.autopilot.state import Vehicle


def _message(vehicle: Vehicle, number: float) -> str | None:
    """The name of a message that this vehicle has."""
    definition = BY_ID.get(int(number)) if isfinite(number) else None
    return definition.name if definition and available(vehicle, definition.name) else None


def _request_message(vehicle: Vehicle, order: Order) -> Verdict:
    name = _message(vehicle, order[1])
    if name is None or not ready(vehicle, name):
        return Verdict(vehicle.flavour.unknown_message_result)
    vehicle.reply(order.peer, name, **BUILDERS[name](vehicle))
    return DONE


def _version_request(vehicle: Vehicle, order: Order) -> Verdict:
    vehicle.reply(order.peer, "AUTOPILOT_VERSION", **BUILDERS["AUTOPILOT_VERSION"](vehicle))
    return DONE


def _home_request(vehicle: Vehicle, order: Order) -> Verdict:
    if not ready(vehicle, "HOME_POSITION"):
        return Verdict(Result.DENIED)
    vehicle.reply(order.peer, "HOME_POSITION", **BUILDERS["HOME_POSITION"](vehicle))
    return DONE


def _set_interval(vehicle: Vehicle, order: Order) -> Verdict:
    """param2 microseconds; -1 off, 0 the default rate."""
    name = _message(vehicle, order[1])
    if name is None or not isfinite(order[2]) or order[2] < -1:
        return Verdict(Result.DENIED)
    vehicle.streams.set_interval(name, order[2] / 1e6, vehicle.now_s)
    return DONE


def _get_interval(vehicle: Vehicle, order: Order) -> Verdict:
    name = _message(vehicle, order[1])
    interval_us = streams.interval_us(vehicle.streams, name) if name else 0
    number = int(order[1]) & 0xFFFF if isfinite(order[1]) else 0
    vehicle.reply(order.peer, "MESSAGE_INTERVAL", message_id=number, interval_us=interval_us)
    return DONE


HANDLERS: dict[int, Handler] = {
    Command.REQUEST_MESSAGE: _request_message,
    Command.REQUEST_AUTOPILOT_CAPABILITIES: _version_request,
    Command.GET_HOME_POSITION: _home_request,
    Command.SET_MESSAGE_INTERVAL: _set_interval,
    Command.GET_MESSAGE_INTERVAL: _get_interval,
}
