"""How fast and how small the mock autopilot is."""

import gc
import os
import socket
import subprocess
import sys
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
from measures import summary

from policy.world.scenario import Area, Scenario
from sitl_mock.autopilot import ARDUPILOT, FLAVOURS
from sitl_mock.campaigns import BatchCampaigns
from sitl_mock.simulation import Setup, Simulation
from sitl_mock.wire import encode

_FIRST_PORT = 21_000
Row = tuple[str, str, str]
CAMPAIGNS, UAVS, USERS = 512, 2, 59
STREAMS = {33: 10.0, 30: 20.0, 32: 10.0, 24: 2.0, 1: 2.0, 147: 2.0, 74: 3.0}  # 49 messages/s and the heartbeat


def mock_speed(quick: bool) -> list[Row]:
    """Batch campaigns, lock step, a hundred vehicles in real time, 250 in one process, memory a vehicle."""
    repeats = 3 if quick else 7
    rate, real_time = "thousand vehicle-slots/s", "% of a core at real time"
    campaigns = f"{CAMPAIGNS} campaigns x {UAVS} vehicles with {USERS} users, physics and service, one thread"
    streaming = _process_shares(100, repeats, streams=STREAMS)
    quiet = _process_shares(250, repeats, streams={})
    return [
        (campaigns, summary(_campaign_rates(repeats), 1e-3), rate),
        (
            "2 vehicles at 50 messages/s each, lock step, no sockets",
            summary(_lock_step_ratios(2, repeats)),
            "x real time",
        ),
        ("100 vehicles at 50 messages/s each, no sockets", summary(_cpu_shares(100, repeats), 100.0), real_time),
        ("100 vehicles on the ground at 50 messages/s each over UDP", summary(streaming, 100.0), real_time),
        ("250 vehicles in one process over UDP, heartbeats", summary(quiet, 100.0), real_time),
        ("memory a vehicle", f"{_memory_kb(100):.0f}", "kB"),
    ]


def _timed(act: Callable[[], None], repeats: int) -> list[float]:
    seconds = []
    for _ in range(repeats):
        begun_s = time.process_time()
        act()
        seconds.append(time.process_time() - begun_s)
    return seconds


def _campaign_rates(repeats: int) -> list[float]:
    scenario = Scenario(
        area=Area((40.42, -86.93), (1667.0, 1222.0)),
        launch_enu_m=np.tile([[833.5, 611.0]], (UAVS, 1)),
        collect_mbps=np.full(USERS, 0.02),
    )
    slots = 20
    rng = np.random.default_rng(0)
    users_m = rng.uniform(300.0, 1100.0, (slots + 1, USERS, 2))
    commands = rng.uniform(-12.0, 12.0, (slots, CAMPAIGNS, UAVS, 2))
    campaigns = BatchCampaigns(scenario, users_m, CAMPAIGNS)
    campaigns.step(commands[0])

    def fly() -> None:
        campaigns.reset()
        for command in commands:
            campaigns.step(command)

    return [slots * CAMPAIGNS * UAVS / seconds for seconds in _timed(fly, repeats)]


def _order(index: int, command: int, *params: float) -> bytes:
    values = {"target_system": index + 1, "target_component": 1, "command": command}
    values |= {f"param{number}": value for number, value in enumerate(params, start=1)}
    return encode("COMMAND_LONG", values, system=245, component=190, seq=0)


def _command(simulation: Simulation, index: int, command: int, *params: float) -> None:
    simulation.receive(index, 1, _order(index, command, *params))


def _flying(count: int) -> Simulation:
    """Vehicles in GUIDED, in the air, streaming."""
    simulation = Simulation(Setup(count=count, flavour=ARDUPILOT, ready_after_s=1.0))
    simulation.advance_to(1.5)
    for index in range(count):
        for message, rate_hz in STREAMS.items():
            _command(simulation, index, 511, message, 1e6 / rate_hz)
        for order in ((176, 1, 4), (400, 1), (22, 0, 0, 0, 0, 0, 0, 20)):
            _command(simulation, index, *order)
    simulation.advance_to(12.0)
    return simulation


def _lock_step_ratios(count: int, repeats: int) -> list[float]:
    simulation = _flying(count)
    seconds = _timed(lambda: _run(simulation, 20.0), repeats)
    return [20.0 / each for each in seconds]


def _cpu_shares(count: int, repeats: int) -> list[float]:
    """CPU seconds a simulated second: what real time costs, without the kernel's share of the sockets."""
    simulation = _flying(count)
    sent = len(_run(simulation, 2.0)) / 2.0 / count
    assert 48.0 < sent < 54.0, f"{sent} messages a vehicle and second"
    return [each / 2.0 for each in _timed(lambda: _run(simulation, 2.0), repeats)]


def _run(simulation: Simulation, seconds: float) -> list[object]:
    return list(simulation.advance_to(simulation.now_s + seconds))


def _process_shares(count: int, repeats: int, *, streams: dict[int, float]) -> list[float]:
    """CPU share of the real process with its sockets, over three wall seconds each."""
    options = ["--count", str(count), "--first-port", str(_FIRST_PORT), "--flavour", "ardupilot"]
    command = [sys.executable, "-m", "sitl_mock", *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process, _listener() as station:
        assert process.stdout is not None
        for _ in range(count):
            process.stdout.readline()
        for index in range(count):
            for message, rate_hz in streams.items():
                frame = _order(index, 511, message, 1e6 / rate_hz)
                station.sendto(frame, ("127.0.0.1", _FIRST_PORT + index))
        time.sleep(1.0)
        shares = []
        for _ in range(repeats):
            begun = _cpu_s(process.pid)
            time.sleep(3.0)
            shares.append((_cpu_s(process.pid) - begun) / 3.0)
        process.terminate()
    return shares


def _listener() -> socket.socket:
    """A ground station that never reads: what it costs to send is paid all the same."""
    return socket.socket(socket.AF_INET, socket.SOCK_DGRAM)


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _memory_kb(count: int) -> float:
    Simulation(Setup(count=1))
    gc.collect()
    tracemalloc.start()
    simulation = Simulation(Setup(count=count, flavour=FLAVOURS["px4"], ready_after_s=1.0))
    simulation.advance_to(5.0)
    gc.collect()
    kilobytes = tracemalloc.get_traced_memory()[0] / count / 1e3
    tracemalloc.stop()
    return kilobytes
