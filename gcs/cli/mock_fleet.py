"""Mock drones in a process of their own, on free ports, gone when the flight is over."""

import re
import socket
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import IO

from gcs.cli.errors import UsageError

START_TIMEOUT_S = 90.0  # a first start compiles the mock's physics
END_TIMEOUT_S = 5.0
PORT_TRIES = 5
_LOCKSTEP = re.compile(r"lockstep ready: tcp:([^:\s]+):(\d+)")
_DRONE = re.compile(r"drone \d+ ready: (\S+) sysid (\d+)")


@dataclass(frozen=True)
class MockFleet:
    """Where the mock's clock and its drones listen."""

    clock: tuple[str, int]
    drones: dict[str, int]  # address -> system id


@dataclass(frozen=True)
class MockOptions:
    """What the fleet is like."""

    count: int
    home: tuple[float, float, float]
    flavour: str = "px4"
    extra: tuple[str, ...] = ()


@contextmanager
def mock_fleet(options: MockOptions) -> Iterator[MockFleet]:
    """Start the mock and wait until every drone is ready; ends it in every case."""
    for attempt in range(1, PORT_TRIES + 1):
        with tempfile.TemporaryFile("w+") as errors:
            process = _start(options, errors)
            try:
                fleet = _read_addresses(process, options.count)
                if fleet is not None:
                    yield fleet
                    return
                words = _words(process, errors)
            finally:
                _end(process)
        if "port" not in words or attempt == PORT_TRIES:
            raise UsageError(f"the mock fleet did not start: {words}")


def free_udp_ports(count: int) -> int:
    """The first of ``count`` UDP ports in a row that were free a moment ago."""
    for _ in range(100):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            first = int(probe.getsockname()[1])
        if first + count < 65536 and all(_is_free(port) for port in range(first, first + count)):
            return first
    raise UsageError(f"found no {count} free UDP ports in a row on 127.0.0.1")


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("127.0.0.1", port))
        except OSError:
            return False
        return True


def _start(options: MockOptions, errors: IO[str]) -> subprocess.Popen[str]:
    home = ",".join(f"{value:.7f}" for value in options.home)
    command = [sys.executable, "-m", "sitl_mock", "--count", str(options.count), "--flavour", options.flavour]
    command += ["--home", home, "--lockstep", "0", "--first-port", str(free_udp_ports(options.count)), *options.extra]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors, text=True)  # noqa: S603  # our own module


def _read_addresses(process: subprocess.Popen[str], count: int) -> MockFleet | None:
    """None when the mock ended, or said nothing for too long."""
    clock: tuple[str, int] | None = None
    drones: dict[str, int] = {}
    watchdog = threading.Timer(START_TIMEOUT_S, process.kill)
    watchdog.start()
    try:
        assert process.stdout is not None
        for line in process.stdout:
            if found := _LOCKSTEP.search(line):
                clock = (found[1], int(found[2]))
            if found := _DRONE.search(line):
                drones[found[1]] = int(found[2])
            if clock is not None and len(drones) == count:
                return MockFleet(clock, drones)
    finally:
        watchdog.cancel()
    return None


def _words(process: subprocess.Popen[str], errors: IO[str]) -> str:
    process.wait(END_TIMEOUT_S)
    errors.seek(0)
    lines = errors.read().strip().splitlines()
    return lines[-1] if lines else f"it ended with code {process.returncode}"


def _end(process: subprocess.Popen[str]) -> None:
    """It ends by itself when the clock hangs up; otherwise it is told."""
    try:
        process.wait(1.0)
    except subprocess.TimeoutExpired:
        process.terminate()
        try:
            process.wait(END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
    if process.stdout is not None:
        process.stdout.close()
