"""Command line: `python -m sitl_mock --count N` starts N mock autopilots (docs/mock.md)."""

from __future__ import annotations

import argparse
import signal
import socket
import sys
from contextlib import ExitStack, closing
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import shtab

from sitl_mock.autopilot import FLAVOURS
from sitl_mock.control import Control
from sitl_mock.faults import FaultFileError, load
from sitl_mock.geodesy import Geodetic
from sitl_mock.physics.vehicle import M600
from sitl_mock.ports import Port, PortTakenError, SerialPort, TcpPort, UdpPort, listen
from sitl_mock.server import Server
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


def _key(text: str) -> bytes:
    try:
        key = bytes.fromhex(text)
    except ValueError:
        key = b""
    if len(key) != 32:
        raise argparse.ArgumentTypeError("is not 64 hex digits (32 bytes); make one with: openssl rand -hex 32")
    return key


def _version() -> str:
    try:
        return version("uav-crowdsensing")
    except PackageNotFoundError:
        return "unknown"


def parser() -> argparse.ArgumentParser:
    """All options."""
    options = _Parser(prog="sitl-mock", description="Mock MAVLink autopilots with real motion, for tests and demos.")
    options.add_argument("--version", action="version", version=f"%(prog)s {_version()}")
    shtab.add_argument_to(options, "--print-completion", help="print a completion script for this shell")
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
    add("--ready-after-s", type=_number(0, 600), help="position estimate good after (default: as the real one)")
    add("--tcp-first-port", type=_whole(0, 65535), metavar="P", help="TCP port of drone 1 besides (0: any free)")
    add("--serial", action="store_true", help="besides a serial line (pseudo terminal) a drone")
    add("--control", type=_whole(0, 65535), metavar="PORT", help="HTTP control of faults (0: any free port)")
    add("--gusts-ms", type=_number(0, 40), default=0.0, metavar="W20", help="Dryden gusts by the wind at 20 ft")
    add("--gps-noise-m", type=_number(0, 100), default=0.0, help="standard deviation of the receiver (default 0)")
    add("--gps-delay-s", type=_number(0, 5), default=0.2, help="how late the receiver reports (default 0.2)")
    add("--ambient-c", type=_number(-60, 60), default=20.0, help="air temperature, degrees Celsius (default 20)")
    add("--signing-key", type=_key, metavar="HEX", help="64 hex digits: take and send signed messages only")
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
        gust_w20_mps=args.gusts_ms,
        gps_noise_m=args.gps_noise_m,
        gps_delay_s=args.gps_delay_s,
        ambient_c=args.ambient_c,
        key=args.signing_key,
        ready_after_s=args.ready_after_s,
        faults=faults,
        seed=args.seed,
    )


def _stop(_number: int, _frame: FrameType | None) -> NoReturn:
    raise KeyboardInterrupt


def _ways(args: argparse.Namespace, index: int) -> list[Port]:
    """The ports of one vehicle: UDP first. Raises PortTakenError; nothing stays open then."""
    ways: list[Port] = [UdpPort(args.host, args.first_port + index, args.target)]
    try:
        if args.tcp_first_port is not None:
            ways.append(TcpPort(args.host, args.tcp_first_port + index if args.tcp_first_port else 0))
        if args.serial:
            ways.append(SerialPort())
    except OSError:
        for way in ways:
            way.close()
        raise
    return ways


def _address(way: Port) -> str:
    """How a ground station reaches it, in the notation of pymavlink."""
    if isinstance(way, SerialPort):
        return way.path
    assert isinstance(way, UdpPort | TcpPort)
    return f"{'udpout' if isinstance(way, UdpPort) else 'tcp'}:{way.address[0]}:{way.address[1]}"


def _announce(ports: list[list[Port]], flavour: str) -> None:
    for system, (udp, *more) in enumerate(ports, start=1):
        besides = "".join(f" {_address(way)}" for way in more)
        print(f"drone {system} ready: {_address(udp)} sysid {system} {flavour}{besides}", flush=True)


def _serve(args: argparse.Namespace) -> None:
    setup = _setup(args)
    for option, first in (("--first-port", args.first_port), ("--tcp-first-port", args.tcp_first_port or 0)):
        if first + args.count - 1 > 65535:
            raise PortTakenError(f"{option} {first} leaves no room for {args.count} ports up to 65535")
    with ExitStack() as stack:
        listener = control = None
        if args.lockstep is not None:
            listener = stack.enter_context(listen(args.host, args.lockstep, "--lockstep"))
        if args.control is not None:
            control = stack.enter_context(closing(Control(args.host, args.control)))
        ports: list[list[Port]] = []
        for index in range(args.count):
            ports.append(_ways(args, index))
            for way in ports[-1]:
                stack.callback(way.close)
        server = Server(Simulation(setup), ports, control)
        if listener is not None:
            print(f"lockstep ready: tcp:{args.host}:{listener.getsockname()[1]}", flush=True)
        if control is not None:
            print(f"control ready: http://{control.address[0]}:{control.address[1]}", flush=True)
        _announce(ports, args.flavour)
        if listener is not None:
            server.run_in_lock_step(listener)
        else:
            server.run_in_real_time(args.speedup)


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
