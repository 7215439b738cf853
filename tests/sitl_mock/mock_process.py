"""`python -m sitl_mock` as a process of its own, and its lock-step clock."""

from __future__ import annotations

import json
import re
import socket
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from pymavlink import mavutil

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[2]


def free_port(count: int = 1) -> int:
    """The first of `count` UDP ports in a row that are free now."""
    while True:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            first = int(probe.getsockname()[1])
        try:
            for port in range(first, first + count):
                with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                    probe.bind(("127.0.0.1", port))
        except (OSError, OverflowError):
            continue
        return first


@dataclass
class Mock:
    """A running mock: its process, its ready lines and the clock connection (lock step only)."""

    process: subprocess.Popen[str]
    lines: list[str]
    clock: socket.socket | None
    replies: TextIO | None

    def advance_to(self, until_s: float) -> float:
        assert self.clock is not None
        assert self.replies is not None
        self.clock.sendall(json.dumps({"advance_to_s": until_s}).encode() + b"\n")
        return float(json.loads(self.replies.readline())["now_s"])


@contextmanager
def running(*options: str, count: int = 1, lockstep: bool = True) -> Iterator[Mock]:
    extra = ["--lockstep", "0"] if lockstep else []
    command = [sys.executable, "-m", "sitl_mock", "--count", str(count), *extra, *options]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        lines = [process.stdout.readline().strip() for _ in range(count + lockstep)]
        clock, replies = None, None
        try:
            if lockstep:
                match = re.fullmatch(r"lockstep ready: tcp:([\d.]+):(\d+)", lines[0])
                assert match, lines
                clock = socket.create_connection((match[1], int(match[2])), timeout=30)
                replies = clock.makefile("r")
            yield Mock(process, lines, clock, replies)
        finally:
            if replies is not None:
                replies.close()
            if clock is not None:
                clock.close()
            else:
                process.terminate()
            process.wait(timeout=10)
            assert process.stderr is not None
            assert "Traceback" not in process.stderr.read()


def connect(port: int) -> Any:
    """A pymavlink connection as system 245."""
    return mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=245, source_component=190)
