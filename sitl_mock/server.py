"""The mock on the network: UDP ports around a simulation, driven by the wall clock or in lock step."""

from __future__ import annotations

import json
import selectors
import socket
import time
from math import isfinite
from typing import TYPE_CHECKING

from sitl_mock.physics.fleet import TICK_S

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sitl_mock.control import Control
    from sitl_mock.ports import Port
    from sitl_mock.simulation import Datagram, Simulation

_CATCH_UP_S = 1.0  # further behind the wall clock than this, simulated time gives way
_BURST_TICKS = 25  # steps between two looks at the sockets
_MAX_LINE_BYTES = 4096
_WAYS = 4  # UDP, TCP, serial: the simulation sees one number a peer, whatever way it takes


def _peer(way: int, number: int) -> int:
    return number * _WAYS + way


class Server:
    """Moves bytes between the vehicles' ports and the simulation."""

    def __init__(self, simulation: Simulation, ports: Sequence[Sequence[Port]], control: Control | None = None) -> None:
        """`ports[i]` are the ways to vehicle i."""
        self._simulation = simulation
        self._ports = ports
        self._control = control

    def receive(self) -> None:
        """Hands everything that waits to its vehicle."""
        for index, ways in enumerate(self._ports):
            for way, port in enumerate(ways):
                for received in port.drain():
                    if received.forgotten is not None:
                        self._simulation.forget(index, _peer(way, received.forgotten))
                    if received.data:
                        self._simulation.receive(index, _peer(way, received.peer), received.data)

    def send(self, datagrams: list[Datagram]) -> None:
        """Puts datagrams on the wire."""
        for datagram in datagrams:
            ways = self._ports[datagram.index]
            if datagram.peer is None:
                for port in ways:
                    port.send(None, datagram.data)
            else:
                ways[datagram.peer % _WAYS].send(datagram.peer // _WAYS, datagram.data)

    def _answer_control(self) -> None:
        if self._control is not None:
            self._control.serve(self._simulation)

    def run_in_real_time(self, speedup: float) -> None:
        """Simulated time is wall time times `speedup`, until interrupted."""
        simulation = self._simulation
        files = [port for ways in self._ports for port in ways]
        origin_s = time.monotonic()
        with selectors.DefaultSelector() as selector:
            for file in files:
                selector.register(file.fileno(), selectors.EVENT_READ)
            while True:
                self.receive()
                self._answer_control()
                due_s = (time.monotonic() - origin_s) * speedup
                if due_s - simulation.now_s > _CATCH_UP_S * speedup:
                    origin_s = time.monotonic() - simulation.now_s / speedup
                    continue
                for _ in range(_BURST_TICKS):
                    if simulation.now_s + TICK_S > due_s:
                        break
                    self.send(simulation.step())
                else:
                    continue
                wait_s = (simulation.now_s + TICK_S - due_s) / speedup
                selector.select(max(wait_s, 0.0))

    def run_in_lock_step(self, listener: socket.socket) -> None:
        """Serves one client that says how far time may go; returns when it leaves.

        One JSON object a line: {"advance_to_s": 12.3} is answered by {"now_s": 12.3}, or by {"error": "..."}.
        """
        client, _ = listener.accept()
        client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with client, client.makefile("rb") as lines:
            while line := lines.readline(_MAX_LINE_BYTES):
                client.sendall(json.dumps(self._answer(line)).encode() + b"\n")

    def _answer(self, line: bytes) -> dict[str, float | str]:
        until_s = _until_s(line)
        if until_s is None:
            return {"error": 'not understood; send one line {"advance_to_s": seconds}'}
        self._answer_control()
        self.receive()
        self.send(self._simulation.pending() + self._simulation.advance_to(until_s))
        return {"now_s": round(self._simulation.now_s, 6)}

    def close(self) -> None:
        """Gives all ports back."""
        for ways in self._ports:
            for port in ways:
                port.close()


def _until_s(line: bytes) -> float | None:
    """The time asked for; None if the line asks for none."""
    try:
        request = json.loads(line)
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError):
        return None
    until_s = request.get("advance_to_s") if isinstance(request, dict) else None
    good = isinstance(until_s, int | float) and not isinstance(until_s, bool) and isfinite(until_s)
    return float(until_s) if good and until_s is not None else None
