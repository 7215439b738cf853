"""The server's configuration file (TOML). Every key has a default; unknown ones are mistakes.

[server]
host = "127.0.0.1"     # any other address needs API keys: python -m gcs keys add
port = 8080
max_body_kb = 2048
rate_per_s = 500       # requests of one address
max_streams = 100      # clients that follow the stream at a time
speedup = 1.0          # flight seconds a second: other than 1 only with simulated drones that run as fast
[store]
url = "sqlite:///gcs-data/gcs.db"     # or postgresql://USER:PASSWORD@HOST/NAME
[drones]
1 = "udpout:127.0.0.1:14540"          # system id = address; several links with commas between
[link]
library = "pymavlink"                 # or mavsdk
tlog = "logs"                         # folder: record every link (.tlog, a file for each start and address)
signing_key = "signing.hex"           # 64 hex digits, chmod 600: sign all, believe nothing unsigned
[map]
tiles = "https://tiles.example.org/{z}/{x}/{y}.png"   # or: pmtiles = "campus.pmtiles"; neither: plain background
attribution = "who made the map"
[policy]
url = "http://127.0.0.1:8090"         # decide at `policy serve`; left out: in this process
[tls]
certificate = "server.pem"            # with its chain; both or none
key = "server-key.pem"
[users]
keep_places_days = 30                 # after a campaign's end; then the places of its users are wiped
away_after_s = 300                    # a live user of whom nothing is heard for so long takes no part
"""

import tomllib
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

DEFAULT_STORE = "sqlite:///gcs-data/gcs.db"
SystemId = Annotated[int, Field(ge=1, le=250)]  # MAVLink: above are ground stations


class ConfigError(ValueError):
    """The configuration cannot be used: one line that says what, where and how to mend it."""


class Section(BaseModel):
    """Strict about names."""

    model_config = ConfigDict(frozen=True, extra="forbid")


class ServerSection(Section):
    """Where to listen."""

    host: Annotated[str, Field(min_length=1, max_length=255)] = "127.0.0.1"
    port: Annotated[int, Field(ge=0, le=65_535, strict=True)] = 8080
    max_body_kb: Annotated[int, Field(ge=1, le=1_000_000, strict=True)] = 2048
    rate_per_s: Annotated[float, Field(ge=1.0, le=1e6)] = 500.0
    max_streams: Annotated[int, Field(ge=1, le=10_000, strict=True)] = 100
    speedup: Annotated[float, Field(gt=0.0, le=1000.0)] = 1.0  # other than 1 only with simulated drones as fast


class StoreSection(Section):
    """Where records are kept."""

    url: Annotated[str, Field(min_length=1)] = DEFAULT_STORE


class PolicySection(Section):
    """Where decisions are made."""

    url: Annotated[str, Field(pattern=r"^https?://.+")] | None = None


class LinkSection(Section):
    """How vehicles are talked to."""

    library: Literal["pymavlink", "mavsdk"] = "pymavlink"
    signing_key: Path | None = None
    tlog: Path | None = None


class MapSection(Section):
    """What lies under the campaign on the page's map: nothing, tiles of another server, or a PMTiles file here."""

    tiles: Annotated[str, Field(pattern=r"^https?://[^/\s'\";,]+/[^\s]*$")] | None = None
    pmtiles: Path | None = None
    attribution: Annotated[str, Field(max_length=200)] = ""

    @model_validator(mode="after")
    def _one_and_readable(self) -> "MapSection":
        if self.tiles is not None and self.pmtiles is not None:
            raise ValueError("tiles and pmtiles exclude each other; leave one out")
        if self.tiles is not None and not all(part in self.tiles for part in ("{z}", "{x}", "{y}")):
            raise ValueError("tiles must name {z}, {x} and {y}")
        if self.pmtiles is not None and not self.pmtiles.is_file():
            raise ValueError(f"pmtiles: there is no file {self.pmtiles}")
        return self


class TlsSection(Section):
    """Certificate and key, PEM files."""

    certificate: Annotated[str, Field(min_length=1)] | None = None
    key: Annotated[str, Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _both(self) -> "TlsSection":
        if (self.certificate is None) != (self.key is None):
            raise ValueError("certificate and key go together: give both or none")
        return self


class UsersSection(Section):
    """People who report where they are."""

    keep_places_days: Annotated[float, Field(ge=0.0, le=36_500.0)] = 30.0
    away_after_s: Annotated[float, Field(ge=10.0, le=86_400.0)] = 300.0


class ServerConfig(Section):
    """The whole file."""

    server: ServerSection = ServerSection()
    store: StoreSection = StoreSection()
    drones: dict[SystemId, Annotated[str, Field(min_length=1)]] = {}
    link: LinkSection = LinkSection()
    policy: PolicySection = PolicySection()
    map: MapSection = MapSection()
    tls: TlsSection = TlsSection()
    users: UsersSection = UsersSection()


def load_config(path: Path | None) -> ServerConfig:
    """Read and check; no file means the defaults."""
    if path is None:
        return ServerConfig()
    try:
        document = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ConfigError(f"{path}: is no valid TOML: {error}") from None
    return check_config(document, str(path))


def check_config(document: object, origin: str) -> ServerConfig:
    """A parsed document as configuration."""
    try:
        return ServerConfig.model_validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        section, *keys = map(str, first["loc"] or ("file",))
        where = f"[{section}] {'.'.join(keys)}".strip()
        raise ConfigError(f"{origin}: {where}: {_words(first['type'], first['msg'])}") from None


def _words(kind: str, message: str) -> str:
    return "is no known key; see the head of gcs/config.py" if kind == "extra_forbidden" else message
