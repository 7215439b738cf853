"""The process: real sockets, virtual time, clean ends, clear errors."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import pytest
from mock_process import ROOT, Mock, connect, free_port, running

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def _drive(mock: Mock, now_s: float, seconds: float, act: Callable[[], None], links: list[Any]) -> float:
    """Advances in tenths of a second, calling `act` before each, and empties the links."""
    for _ in range(round(seconds * 10)):
        act()
        now_s = mock.advance_to(round(now_s + 0.1, 3))
        for link in links:
            while link.recv_msg() is not None:
                pass
    return now_s


def test_two_drones_fly_over_udp_in_virtual_time() -> None:
    port = free_port(2)
    with running("--first-port", str(port), "--flavour", "ardupilot", "--ready-after-s", "1", count=2) as mock:
        assert mock.lines[1] == f"drone 1 ready: udpout:127.0.0.1:{port} sysid 1 ardupilot"
        assert mock.lines[2].endswith("sysid 2 ardupilot")
        links = [connect(port), connect(port + 1)]

        def order(number: int, *params: float) -> None:
            for system, link in enumerate(links, start=1):
                link.mav.command_long_send(system, 1, number, 0, *params, *(0,) * (7 - len(params)))

        def heartbeat() -> None:
            for link in links:
                link.mav.heartbeat_send(6, 8, 0, 0, 0)

        def fly_apart() -> None:
            for system, link in enumerate(links, start=1):
                north = 10 if system == 1 else -10
                link.mav.set_position_target_global_int_send(0, system, 1, 6, 3527, 0, 0, 0, north, 0, 0, 0, 0, 0, 0, 0)

        now_s = _drive(mock, 0.0, 2.0, heartbeat, links)
        for number, *params in ((511, 33, 1e5), (176, 1, 4), (400, 1), (22, 0, 0, 0, 0, 0, 0, 20)):
            order(int(number), *params)
            now_s = _drive(mock, now_s, 0.2, heartbeat, links)
            assert all(link.messages["COMMAND_ACK"].result == 0 for link in links)
        now_s = _drive(mock, now_s, 20.0, heartbeat, links)
        assert links[0].messages["GLOBAL_POSITION_INT"].relative_alt == pytest.approx(20_000, abs=500)
        now_s = _drive(mock, now_s, 10.0, fly_apart, links)
        velocities = [link.messages["GLOBAL_POSITION_INT"].vx for link in links]
        assert velocities == pytest.approx([1000, -1000], abs=20)
        assert mock.advance_to(now_s) == now_s  # time does not go by itself
        for link in links:
            link.close()
    assert mock.process.returncode == 0  # the clock's client left


def test_lock_step_is_fast() -> None:
    """2 vehicles, position and attitude at 10 Hz: at least 200 times real time with the clients' share."""
    port = free_port(2)
    with running("--first-port", str(port), "--flavour", "ardupilot", "--ready-after-s", "1", count=2) as mock:
        sockets = [connect(port), connect(port + 1)]
        for system, link in enumerate(sockets, start=1):
            for message in (33, 30):
                link.mav.command_long_send(system, 1, 511, 0, message, 1e5, 0, 0, 0, 0, 0)
        mock.advance_to(2.0)
        start_s = time.perf_counter()
        for step in range(300):
            mock.advance_to(2.0 + 0.1 * (step + 1))
        ratio = 30.0 / (time.perf_counter() - start_s)
        for link in sockets:
            link.close()
    assert ratio > 30.0  # on an idle machine several hundred (docs/mock.md); a shared one must not fail this


def test_rubbish_on_the_clock_is_answered_and_survived() -> None:
    with running("--first-port", str(free_port())) as mock:
        assert mock.clock is not None
        assert mock.replies is not None
        for line in (
            b"hello\n",
            b"[]\n",
            b'{"advance_to_s": "x"}\n',
            b'{"advance_to_s": NaN}\n',
            b"\xff\xfe\n",
        ):
            mock.clock.sendall(line)
            assert "error" in mock.replies.readline()
        assert mock.advance_to(0.1) == 0.1


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_signals_end_it_cleanly(number: signal.Signals) -> None:
    with running("--first-port", str(free_port()), lockstep=False) as mock:
        mock.process.send_signal(number)
        assert mock.process.wait(timeout=10) == 0


def test_real_time_follows_the_wall_clock_times_speedup() -> None:
    port = free_port()
    with running("--first-port", str(port), "--speedup", "20", lockstep=False):
        link = connect(port)
        link.mav.heartbeat_send(6, 8, 0, 0, 0)
        first = link.recv_match(type="SYSTEM_TIME", blocking=True, timeout=10)
        start_s = time.monotonic()
        last = first
        while time.monotonic() - start_s < 1.0:
            last = link.recv_match(type="SYSTEM_TIME", blocking=True, timeout=10)
        wall_s = time.monotonic() - start_s
        gone_s = (last.time_boot_ms - first.time_boot_ms) / 1000
        link.close()
    # A machine too busy to keep up lets simulated time give way, but it never runs ahead.
    assert 0.2 * 20.0 * wall_s <= gone_s <= 20.0 * wall_s + 2.0


def _fails(*options: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "sitl_mock", *options],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    return done.stderr


def test_bad_input_is_one_line_and_exit_2(tmp_path: Path) -> None:
    assert "--home" in _fails("--home", "91,0,0")
    assert "--count" in _fails("--count", "0")
    assert "--wind-ms" in _fails("--wind-ms", "fast")
    assert "--signing-key" in _fails("--signing-key", "secret")
    assert "no-such.toml" in _fails("--faults", str(tmp_path / "no-such.toml"))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        assert "--first-port" in _fails("--first-port", str(taken.getsockname()[1]))


def test_help_exits_0() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "sitl_mock", "--help"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0
    assert "--lockstep" in done.stdout
