"""A received command and the verdict on it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sitl_mock.autopilot.constants import Frame, Result
from sitl_mock.autopilot.state import Vehicle

if TYPE_CHECKING:
    from sitl_mock.wire import Frame as Message


@dataclass(frozen=True, slots=True)
class Order:
    """A received command; `params` are param1..7 with latitude and longitude in degrees."""

    command: int
    params: tuple[float, float, float, float, float, float, float]
    frame: int
    peer: int

    def __getitem__(self, number: int) -> float:
        """Parameter `number`, counted from 1 as the definitions do."""
        return self.params[number - 1]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What COMMAND_ACK says; `text` goes out as STATUSTEXT."""

    result: Result
    text: str = ""
    then_s: float = 0.0  # IN_PROGRESS: ACCEPTED follows so much later


DONE = Verdict(Result.ACCEPTED)
Handler = Callable[[Vehicle, Order], Verdict]


def read(message: Message, peer: int) -> Order:
    """The order in a COMMAND_LONG or COMMAND_INT."""
    values = message.values
    if message.name == "COMMAND_LONG":
        p1, p2, p3, p4, p5, p6, p7 = (values[f"param{i}"] for i in range(1, 8))
        return Order(values["command"], (p1, p2, p3, p4, p5, p6, p7), int(Frame.GLOBAL_RELATIVE_ALT), peer)
    p1, p2, p3, p4 = (values[f"param{i}"] for i in range(1, 5))
    lat_deg, lon_deg = values["x"] / 1e7, values["y"] / 1e7
    return Order(values["command"], (p1, p2, p3, p4, lat_deg, lon_deg, values["z"]), values["frame"], peer)
