"""Command line: `python -m sitl_mock --count N` starts N mock autopilots (docs/mock.md)."""

from __future__ import annotations

import argparse
import signal
import socket
import sys
from contextlib import nullcontext
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from sitl_mock.autopilot import FLAVOURS
from sitl_mock.faults import FaultFileError, load
from sitl_mock.geodesy import Geodetic
from sitl_mock.physics.vehicle import M600
from sitl_mock.ports import Port, PortTakenError
from sitl_mock.server import Server, listen
from sitl_mock.simulation import PURDUE, Setup, Simulation

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from types import FrameType

MAX_COUNT = 250  # system ids 1 to 250 (MAVLink keeps the rest for ground stations and others)


class _Parser(argparse.ArgumentParser):
    """Errors are one line on stderr."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"sitl_mock: {message}\n")


def _number(low: float, high: float) -> Callable[[str], float]:
    def convert(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text!r} is no number from {low:g} to {high:g}")
        return value

    return convert


def _whole(low: int, high: int) -> Callable[[str], int]:
    def convert(text: str) -> int:
        if not text.lstrip("-").isdecimal() or not low <= int(text) <= high:
            raise argparse.ArgumentTypeError(f"{text!r} is no whole number from {low} to {high}")
        return int(text)

    return convert


def _home(text: str) -> Geodetic:
    try:
        lat_deg, lon_deg, alt_m = (float(part) for part in text.split(","))
    except ValueError:
        lat_deg = lon_deg = alt_m = float("nan")
    if not (abs(lat_deg) < 89.9 and abs(lon_deg) <= 180.0 and isfinite(alt_m)):
        raise argparse.ArgumentTypeError(f"{text!r} is no LAT,LON,ALT, e.g. 40.4258,-86.9197,186")
    return Geodetic(lat_deg, lon_deg, alt_m)


def _wind(text: str) -> tuple[float, float]:
    try:
        speed_mps, from_deg = (float(part) for part in text.split(","))
    except ValueError:
        speed_mps = from_deg = float("nan")
    if not (0.0 <= speed_mps <= 40.0 and 0.0 <= from_deg <= 360.0):
        raise argparse.ArgumentTypeError(f"{text!r} is no SPEED,FROM_DEG, e.g. 6,270 for 6 m/s from the west")
    return speed_mps, from_deg


def _target(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or not 1 <= int(port) <= 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is no HOST:PORT, e.g. 127.0.0.1:14550")
    try:  # once, here: a name looked up at every datagram would stall the simulation
        return socket.gethostbyname(host), int(port)
    except OSError as error:
        raise argparse.ArgumentTypeError(f"{host!r} is no known host") from error


def parser() -> argparse.ArgumentParser:
    """All options."""
    options = _Parser(prog="sitl_mock", description="Mock MAVLink autopilots with real motion, for tests and demos.")
    add = options.add_argument
    add("--count", type=_whole(1, MAX_COUNT), default=1, help="vehicles, system ids 1..N (default 1)")
    add("--flavour", choices=sorted(FLAVOURS), default="px4", help="whose manners (default px4)")
    add("--home", type=_home, default=PURDUE, metavar="LAT,LON,ALT", help="pad of drone 1: degrees, m AMSL")
    add("--host", default="127.0.0.1", help="address to bind (default 127.0.0.1)")
    add(
        "--first-port",
        type=_whole(1, 65535),
        default=14550,
        metavar="P",
        help="UDP port of drone 1 (default 14550)",
    )
    add("--target", type=_target, metavar="HOST:PORT", help="also push telemetry to this ground station")
    add("--speedup", type=_number(0.01, 1000), default=1.0, metavar="X", help="simulated seconds a second")
    add(
        "--lockstep",
        type=_whole(0, 65535),
        metavar="PORT",
        help="time is driven over this TCP port (0: any free)",
    )
    add("--faults", type=Path, metavar="FILE", help="TOML script of faults")
    add(
        "--spacing-m",
        type=_number(0, 1000),
        default=4.0,
        help="pads lie this far apart to the east (default 4)",
    )
    add("--wind-ms", type=_wind, default=(0.0, 0.0), metavar="SPEED,FROM_DEG", help="steady wind")
    add("--accel", type=_number(0.1, 20), metavar="MPS2", help="horizontal acceleration limit (default 4.5)")
    add("--max-speed", type=_number(0.5, 20), metavar="MPS", help="horizontal speed limit (default 18)")
    add("--battery-mah", type=_number(1, 1e6), help="battery charge (default 4500)")
    add("--battery-v", type=_number(3, 100), help="battery nominal voltage (default 22.2)")
    add(
        "--ready-after-s",
        type=_number(0, 600),
        help="position estimate good after (default: as the real one)",
    )
    add("--seed", type=_whole(0, 2**63 - 1), default=0, help="for everything random")
    return options


def _setup(args: argparse.Namespace) -> Setup:
    """The simulation that the options describe. Raises FaultFileError."""
    flavour = FLAVOURS[args.flavour]
    changes = {
        "max_accel_mps2": args.accel,
        "max_speed_mps": args.max_speed,
        "battery_mah": args.battery_mah,
        "battery_v": args.battery_v,
    }
    kind = replace(M600, **{name: value for name, value in changes.items() if value is not None})
    faults = load(args.faults, vehicles=args.count, modes=flavour.modes.names) if args.faults else []
    return Setup(
        count=args.count,
        flavour=flavour,
        kind=kind,
        home=args.home,
        spacing_m=args.spacing_m,
        wind_mps=args.wind_ms[0],
        wind_from_deg=args.wind_ms[1],
        ready_after_s=args.ready_after_s,
        faults=faults,
        seed=args.seed,
    )


def _stop(_number: int, _frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt


def _serve(args: argparse.Namespace) -> None:
    setup = _setup(args)
    if args.first_port + args.count - 1 > 65535:
        raise PortTakenError(f"--first-port {args.first_port} leaves no room for {args.count} ports up to 65535")
    with listen(args.host, args.lockstep) if args.lockstep is not None else nullcontext() as listener:
        ports: list[Port] = []
        try:
            ports += (Port(args.host, args.first_port + i, args.target) for i in range(args.count))
            server = Server(Simulation(setup), ports)
            if listener is not None:
                print(f"lockstep ready: tcp:{args.host}:{listener.getsockname()[1]}", flush=True)
            for system, port in enumerate(ports, start=1):
                where = f"udpout:{args.host}:{port.address[1]}"
                print(f"drone {system} ready: {where} sysid {system} {args.flavour}", flush=True)
            if listener is not None:
                server.run_in_lock_step(listener)
            else:
                server.run_in_real_time(args.speedup)
        finally:
            for port in ports:
                port.close()


def main(argv: Sequence[str] | None = None) -> int:
    """Runs until interrupted (or, in lock step, until the client leaves); returns the exit code."""
    args = parser().parse_args(argv)
    signal.signal(signal.SIGTERM, _stop)
    signal.signal(signal.SIGINT, _stop)
    try:
        _serve(args)
    except (FaultFileError, PortTakenError) as error:
        print(f"sitl_mock: {error}", file=sys.stderr)
        return 2
    except (KeyboardInterrupt, ConnectionError):
        return 0
    return 0


if __name__ == "__main__":
    sys.exit(main())
