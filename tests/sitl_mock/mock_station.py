"""A ground station for tests: pymavlink's codec on one side, the simulation without sockets on the other."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl_mock.autopilot import FLAVOURS
from sitl_mock.simulation import Setup, Simulation

if TYPE_CHECKING:
    from collections.abc import Callable

ARM, TAKEOFF, MODE, RTL, LAND = 400, 22, 176, 20, 21
VELOCITY, VELOCITY_YAW = 3527, 2503


class Station:
    """Speaks with vehicle `index` as system `system`; every received message is kept in `heard`."""

    def __init__(self, simulation: Simulation, *, index: int = 0, system: int = 245, peer: int = 1) -> None:
        self.simulation, self.index, self.peer = simulation, index, peer
        self.target = index + 1
        self.mav = mav.MAVLink(io.BytesIO(), srcSystem=system, srcComponent=190)
        self._decoder = mav.MAVLink(io.BytesIO())
        self._decoder.robust_parsing = True
        self.heard: list[Any] = []

    @property
    def now_s(self) -> float:
        return self.simulation.now_s

    def send(self, message: Any) -> None:
        self.simulation.receive(self.index, self.peer, bytes(message.pack(self.mav)))

    def run(self, seconds: float, *, every_s: float = 0.0, do: Callable[[], None] | None = None) -> list[Any]:
        """Lets time pass, calling `do` every `every_s`; returns what was heard meanwhile."""
        before = len(self.heard)
        until_s = self.now_s + seconds
        next_s = self.now_s
        while self.now_s < until_s - 1e-9:
            if do is not None and self.now_s >= next_s - 1e-9:
                do()
                next_s += every_s
            self._take(self.simulation.step())
        return self.heard[before:]

    def run_until(self, true: Callable[[], bool], limit_s: float) -> float:
        start_s = self.now_s
        while not true():
            assert self.now_s - start_s < limit_s, f"not reached within {limit_s} s"
            self._take(self.simulation.step())
        return self.now_s - start_s

    def _take(self, datagrams: list[Any]) -> None:
        for datagram in datagrams:
            if datagram.index == self.index and datagram.peer in (None, self.peer):
                self.heard += self._decoder.parse_buffer(bytearray(datagram.data)) or []

    def command(self, number: int, *params: float, component: int = 1, target: int | None = None) -> int | None:
        """Sends a COMMAND_LONG and returns the verdict of its acknowledgement, None if none came."""
        full = (*params, *(0.0,) * (7 - len(params)))
        system = self.target if target is None else target
        self.send(mav.MAVLink_command_long_message(system, component, number, 0, *full))
        acks = [m for m in self.run(0.1) if m.get_type() == "COMMAND_ACK" and m.command == number]
        assert len(acks) <= 1
        return acks[0].result if acks else None

    def velocity(self, north: float, east: float, down: float = 0.0, *, mask: int = VELOCITY, yaw: float = 0.0) -> None:
        self.send(
            mav.MAVLink_set_position_target_global_int_message(
                0, self.target, 1, 6, mask, 0, 0, 0, north, east, down, 0, 0, 0, yaw, 0
            )
        )

    def last(self, name: str) -> Any:
        return next(m for m in reversed(self.heard) if m.get_type() == name)

    def texts(self) -> list[str]:
        return [m.text for m in self.heard if m.get_type() == "STATUSTEXT"]

    @property
    def vehicle(self) -> Any:
        return self.simulation.autopilots[self.index].vehicle


def station(flavour: str = "ardupilot", **changes: Any) -> Station:
    """A station with one vehicle that is ready two seconds after boot."""
    setup = {"ready_after_s": 2.0, "flavour": FLAVOURS[flavour], **changes}
    return Station(Simulation(Setup(**setup)))


def fly(ground: Station, height_m: float = 30.0) -> None:
    """Ready, armed, taken off, hovering."""
    ground.run(2.5)
    if ground.vehicle.flavour.name == "ardupilot":
        assert ground.command(MODE, 1, 4) == 0
        assert ground.command(ARM, 1) == 0
        assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, height_m) == 0
    else:
        assert ground.command(ARM, 1) == 0
        amsl = ground.vehicle.body.pad.alt_amsl_m + height_m
        assert ground.command(TAKEOFF, 0, 0, 0, 0, 0, 0, amsl) == 0
    ground.run_until(lambda: abs(ground.vehicle.alt_home_m - height_m) < 0.5, 60.0)
    ground.run(3.0)
