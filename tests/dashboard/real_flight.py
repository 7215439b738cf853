"""``gcs serve`` as a process, over two mock drones in a process of their own: nothing here is a stand-in."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from gcs.cli.mock_fleet import free_udp_ports
from gcs.store.keys import Role
from gcs.store.store import using_store

MISSION = """
[campaign]
name = "field"
slots = 40
slot_s = 15.0
[area]
south_west = [40.4203, -86.93]
size_m = [1667.0, 1222.0]
[[area.obstacles]]
name = "hall"
height_m = 60.0
polygon_m = [[300.0, 300.0], [420.0, 300.0], [420.0, 380.0], [300.0, 380.0]]
[fleet]
uavs = 2
altitude_m = 45.0
max_speed_mps = 15.0
launch_m = [873.0, 611.0]
[users]
source = "walkers"
count = 30
[policy]
name = "receding-horizon"
"""
HOME = "40.4258,-86.9197,186"
SPEEDUP = 3.0
"""Flight seconds a second. ArduPilot brakes after 3 s without setpoints, so the machine may stall for 1 s."""


@contextmanager
def mock_drones(ready_after_s: float = 20.0) -> Iterator[int]:
    """The first port; drones become ready to fly by position a while after they are heard."""
    port = free_udp_ports(2)
    words = ["--count", "2", "--first-port", str(port), "--speedup", str(SPEEDUP), "--home", HOME]
    command = [
        sys.executable,
        "-m",
        "sitl_mock",
        "--flavour",
        "ardupilot",
        *words,
        "--ready-after-s",
        str(ready_after_s),
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for _ in range(2):
            assert "ready" in process.stdout.readline()
        try:
            yield port
        finally:
            process.terminate()


class RealServer:
    """Started, killed and started again on one port, over one store with one operator's key."""

    def __init__(self, folder: Path, drones_port: int) -> None:
        (folder / "missions").mkdir()
        (folder / "missions" / "field.toml").write_text(MISSION)
        self._folder, self._drones_port, self._port = folder, drones_port, 0
        self._process: subprocess.Popen[str] | None = None
        with using_store(self.store_url) as store:
            self.key = store.keys.add("ann", Role.OPERATOR)[1]

    @property
    def store_url(self) -> str:
        return f"sqlite:///{self._folder / 'gcs.db'}"

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self._port}/"

    def start(self) -> None:
        drones = [f"--drone={i + 1}=udpout:127.0.0.1:{self._drones_port + i}" for i in range(2)]
        words = ["serve", "--port", str(self._port), "--store", self.store_url, "--speedup", str(SPEEDUP), *drones]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "gcs", *words], cwd=self._folder, stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        said = self._process.stdout.readline()
        assert "open http://" in said, said
        self._port = int(said.rstrip("/\n").rpartition(":")[2])

    def kill(self) -> None:
        """SIGKILL: nothing is put away."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None


@contextmanager
def real_server(folder: Path) -> Iterator[RealServer]:
    """Up, with its drones."""
    with mock_drones() as port:
        server = RealServer(folder, port)
        server.start()
        try:
            yield server
        finally:
            server.kill()
