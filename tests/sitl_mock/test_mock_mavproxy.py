"""MAVProxy, headless, over TCP: the ground station that ArduPilot's own developers use."""

from __future__ import annotations

import os
import re
import select
import subprocess
import sys
import time
from pathlib import Path

import pytest
from mock_process import free_port, running
from pymavlink import mavutil

pytest.importorskip("MAVProxy")

_MISSION = """QGC WPL 110
0\t0\t0\t16\t0\t0\t0\t0\t40.4258\t-86.9197\t186\t1
1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t15\t1
2\t0\t3\t16\t0\t0\t0\t0\t40.4263\t-86.9197\t15\t1
"""


class Console:
    """MAVProxy's prompt: what is typed, and what it says."""

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        self._process, self.said = process, ""

    def type(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(line.encode() + b"\n")
        self._process.stdin.flush()

    def hears(self, pattern: str, limit_s: float = 30.0) -> re.Match[str]:
        """Reads on until the pattern comes; what came before it is done with."""
        assert self._process.stdout is not None
        end_s = time.monotonic() + limit_s
        while (found := re.search(pattern, self.said)) is None:
            assert time.monotonic() < end_s, f"{pattern!r} not said, but: {self.said}"
            if select.select([self._process.stdout], [], [], 0.2)[0]:
                data = os.read(self._process.stdout.fileno(), 65_536)
                assert data, f"MAVProxy ended: {self.said}"
                self.said += data.decode(errors="replace")
        self.said = self.said[found.end() :]
        return found


def _types(path: Path) -> set[str]:
    log = mavutil.mavlink_connection(str(path))
    types = set()
    while (message := log.recv_match()) is not None:
        types.add(message.get_type())
    log.close()
    return types


def test_parameters_mode_arming_mission_and_log(tmp_path: Path) -> None:
    tcp = free_port()
    options = ("--first-port", str(free_port()), "--tcp-first-port", str(tcp), "--flavour", "ardupilot")
    (tmp_path / "m.txt").write_text(_MISSION)
    with running(*options, "--ready-after-s", "2", "--speedup", "4", lockstep=False):
        command = [sys.executable, str(Path(sys.executable).with_name("mavproxy.py"))]
        command += [f"--master=tcp:127.0.0.1:{tcp}", f"--state-basedir={tmp_path}", f"--logfile={tmp_path / 'm.tlog'}"]
        command += ["--default-modules=log,wp,param,arm,mode,link,misc,cmdlong"]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        with subprocess.Popen(command, cwd=tmp_path, bufsize=0, **pipes) as process:
            try:
                console = Console(process)
                console.type("set flushlogs True")
                assert int(console.hears(r"Received (\d+) parameters")[1]) > 40
                console.type("mode GUIDED")
                console.hears("Mode GUIDED")
                console.type("arm throttle")
                console.hears("COMPONENT_ARM_DISARM: ACCEPTED")
                console.hears("ARMED")
                console.type("wp load m.txt")
                console.hears("MISSION_ACK: TYPE_MISSION: ACCEPTED")
                console.type("wp list")
                console.hears(r"16 3 40\.4263000000 -86\.9197000000 15\.0")
                console.type("param show RTL_ALT")
                console.hears(r"RTL_ALT +1500")
                wanted = {"HEARTBEAT", "PARAM_VALUE", "COMMAND_ACK", "MISSION_ITEM_INT"}
                end_s = time.monotonic() + 20
                while not wanted <= _types(tmp_path / "m.tlog"):  # its log is written by a thread of its own
                    assert time.monotonic() < end_s, "the log lacks messages"
                    time.sleep(0.2)
                console.type("exit")
                assert process.stdin is not None
                process.stdin.close()  # its prompt waits for one more line otherwise
                process.wait(20)
            finally:
                process.kill()
