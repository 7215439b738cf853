"""HTTP control of a running mock: look at the vehicles, list, add and end faults. JSON in and out, loopback only.

GET /vehicles, GET /faults, POST /faults (one fault, the keys of the TOML file; `at_s` counts from now),
DELETE /faults/NUMBER. Requests are answered between two steps of the simulation, by the simulation's own thread.
"""

from __future__ import annotations

import json
import queue
import threading
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from math import isfinite
from typing import TYPE_CHECKING, Any

from sitl_mock.faults import Fault, FaultError, parse
from sitl_mock.ports import PortTakenError

if TYPE_CHECKING:
    from sitl_mock.simulation import Simulation

_MAX_BODY_BYTES = 65_536
_PATIENCE_S = 10.0  # in lock step the answer waits for the clock's client


@dataclass(frozen=True, slots=True)
class Reply:
    """Status and body."""

    status: int
    body: Any


@dataclass(slots=True)
class _Call:
    method: str
    path: str
    body: bytes
    reply: Reply = field(default_factory=lambda: Reply(503, {"error": "time stands still; advance the clock"}))
    done: threading.Event = field(default_factory=threading.Event)
    given_up: bool = False


def _shown(number: int, fault: Fault, *, on: bool) -> dict[str, Any]:
    shown = {key: value for key, value in asdict(fault).items() if not isinstance(value, float) or isfinite(value)}
    return {"number": number, "on": on} | shown


def _vehicles(simulation: Simulation) -> list[dict[str, Any]]:
    shown = []
    for autopilot in simulation.autopilots:
        vehicle = autopilot.vehicle
        shown.append({
            "system": vehicle.system,
            "mode": vehicle.mode.name,
            "armed": vehicle.armed,
            "flying": vehicle.flying,
            "true_ned_m": [round(value, 3) for value in vehicle.body.true_ned_m],
            "battery": round(vehicle.body.battery.remaining, 4),
        })  # fmt: skip
    return shown


def _add(simulation: Simulation, body: bytes) -> Reply:
    try:
        row = json.loads(body)
    except (json.JSONDecodeError, UnicodeDecodeError, RecursionError):
        return Reply(400, {"error": "the body is no JSON"})
    setup = simulation.setup
    try:
        fault = parse(row, vehicles=setup.count, modes=setup.flavour.modes.names)
    except FaultError as error:
        return Reply(400, {"error": str(error)})
    fault = replace(fault, at_s=fault.at_s + simulation.now_s)
    return Reply(201, _shown(simulation.script.add(fault), fault, on=False))


def answer(simulation: Simulation, method: str, path: str, body: bytes) -> Reply:
    """What a request gets. Pure but for the fault script."""
    if (method, path) == ("GET", "/vehicles"):
        return Reply(200, {"now_s": round(simulation.now_s, 3), "vehicles": _vehicles(simulation)})
    if (method, path) == ("GET", "/faults"):
        faults = simulation.script.faults.items()
        return Reply(200, {"faults": [_shown(number, fault, on=on) for number, (fault, on) in faults]})
    if (method, path) == ("POST", "/faults"):
        return _add(simulation, body)
    head, _, number = path.rpartition("/")
    if (method, head) == ("DELETE", "/faults") and number.isdecimal():
        found = simulation.script.remove(int(number))
        return Reply(200, {}) if found else Reply(404, {"error": f"there is no fault {number}"})
    return Reply(404, {"error": "known are GET /vehicles, GET and POST /faults, DELETE /faults/NUMBER"})


class Control:
    """The HTTP server's threads, and the calls that wait for the simulation."""

    def __init__(self, host: str, port: int) -> None:
        """Listens at once. Raises PortTakenError."""
        self._calls: queue.SimpleQueue[_Call] = queue.SimpleQueue()
        try:
            self._server = ThreadingHTTPServer((host, port), _handler(self._calls))
        except OSError as error:
            raise PortTakenError(
                f"TCP {host}:{port} cannot be bound ({error.strerror}); free it or change --control"
            ) from error
        self._server.daemon_threads = True
        self.address = (host, int(self._server.server_address[1]))
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def serve(self, simulation: Simulation) -> None:
        """Answers what has been asked so far."""
        while not self._calls.empty():
            call = self._calls.get()
            if call.given_up:  # its caller was told that nothing happened
                continue
            call.reply = answer(simulation, call.method, call.path, call.body)
            call.done.set()

    def close(self) -> None:
        """Ends the server."""
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()


def _handler(calls: queue.SimpleQueue[_Call]) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        timeout = _PATIENCE_S

        def _pass_on(self) -> None:
            length = self.headers.get("Content-Length", "0")
            size = int(length) if length.isdecimal() else _MAX_BODY_BYTES + 1
            if size > _MAX_BODY_BYTES:
                self._say(Reply(413, {"error": f"the body is larger than {_MAX_BODY_BYTES} bytes, or of no size"}))
                return
            call = _Call(self.command, self.path, self.rfile.read(size))
            calls.put(call)
            call.given_up = not call.done.wait(_PATIENCE_S)
            self._say(call.reply)

        def _say(self, reply: Reply) -> None:
            data = json.dumps(reply.body).encode() + b"\n"
            with suppress(ConnectionError):  # who asked has gone, as a health check does that waited long enough
                self.send_response(reply.status)
                self.send_header("Content-Type", "application/json")
                self.send_header("Content-Length", str(len(data)))
                self.end_headers()
                self.wfile.write(data)

        do_GET = do_POST = do_DELETE = _pass_on  # noqa: N815 - the names that http.server calls

        def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - its name in the base class
            """Says nothing: the mock's output is for its ready lines."""

    return Handler
