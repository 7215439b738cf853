"""What the API is told at start."""

import ipaddress
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from urllib.parse import urlsplit

DASHBOARD = Path(__file__).resolve().parents[1] / "dashboard" / "dist"


def server_version() -> str:
    """As installed; from a bare checkout nobody knows."""
    try:
        return version("uav-crowdsensing")
    except PackageNotFoundError:
        return "unknown"


def is_loopback(host: str) -> bool:
    """Reached from this machine only."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


@dataclass(frozen=True)
class MapTiles:
    """What lies under the campaign: tiles at ``url`` ({z}, {x}, {y}), or those of a PMTiles file; neither: nothing."""

    url: str | None = None
    pmtiles: Path | None = None
    attribution: str = ""

    @property
    def origin(self) -> str | None:
        """Of the tiles' server, which the page must be allowed to ask."""
        if self.url is None:
            return None
        parts = urlsplit(self.url)
        return f"{parts.scheme}://{parts.netloc}"


@dataclass(frozen=True)
class ApiSettings:
    """``one_time_key`` is the operator key printed on loopback when none is configured: reading is open then."""

    host: str = "127.0.0.1"
    seats: tuple[int, ...] = ()  # drones in the order in which missions take them; () as heard
    one_time_key: str | None = None
    max_body_bytes: int = 2 * 1024 * 1024
    rate_per_s: float = 500.0  # requests of one address; twice as many in a burst
    max_streams: int = 100  # clients that follow the stream at a time
    request_timeout_s: float = 5.0  # for the flight loop to take up a request
    command_timeout_s: float = 60.0  # for a vehicle's verdict, repeats included
    dashboard: Path = DASHBOARD
    map_tiles: MapTiles = MapTiles()
    version: str = field(default_factory=server_version)

    @property
    def open_reading(self) -> bool:
        """Reading needs no key: loopback, and nobody configured one."""
        return self.one_time_key is not None and is_loopback(self.host)
