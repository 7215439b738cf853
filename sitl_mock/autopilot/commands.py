"""COMMAND_LONG and COMMAND_INT: one handler a command, each with an honest verdict."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sitl_mock.autopilot import flight_commands, message_commands
from sitl_mock.autopilot.constants import Result, Severity
from sitl_mock.autopilot.orders import Handler, Order, Verdict

if TYPE_CHECKING:
    from sitl_mock.autopilot.state import Vehicle

_HANDLERS: dict[int, Handler] = flight_commands.HANDLERS | message_commands.HANDLERS


def execute(vehicle: Vehicle, order: Order) -> Verdict:
    """Carries an order out, or says why not."""
    handler = _HANDLERS.get(order.command)
    if handler is None:
        return Verdict(Result.UNSUPPORTED)
    verdict = handler(vehicle, order)
    if verdict.text:
        good = verdict.result is Result.ACCEPTED
        vehicle.say(Severity.INFO if good else Severity.CRITICAL, verdict.text)
    return verdict
