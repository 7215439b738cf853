"""What lies under the campaign on the map: by configuration, and nobody but the configured server may be asked."""

from pathlib import Path

import httpx
import pytest
from api_server import serving

from gcs.api.guards import page_policy
from gcs.api.settings import ApiSettings, MapTiles
from gcs.config import ConfigError, check_config
from gcs.store.keys import Role
from gcs.store.store import Store

URL = "https://tiles.example.org/{z}/{x}/{y}.png"


def test_without_configuration_the_background_is_plain_and_nobody_is_asked(operator: httpx.Client) -> None:
    answer = operator.get("/api/v1/map")
    assert answer.json() == {"kind": "none", "url": None, "attribution": ""}
    assert "example" not in answer.headers["content-security-policy"]
    assert operator.get("/api/v1/map/tiles.pmtiles").status_code == 404


def test_tiles_of_a_url_open_the_pages_policy_for_that_server_only(server_store: Store, tmp_path: Path) -> None:
    settings = ApiSettings(one_time_key="k", dashboard=tmp_path, map_tiles=MapTiles(url=URL, attribution="us"))
    with serving(server_store, settings) as server, server.client() as client:
        answer = client.get("/api/v1/map")
    assert answer.json() == {"kind": "tiles", "url": URL, "attribution": "us"}
    policy = dict(part.strip().split(" ", 1) for part in page_policy("https://tiles.example.org").split(";"))
    assert answer.headers["content-security-policy"] == page_policy("https://tiles.example.org")
    opened = [name for name, sources in policy.items() if "https://tiles.example.org" in sources]
    assert opened == ["img-src", "connect-src"]


def test_a_pmtiles_file_is_read_in_parts_and_needs_a_key_where_reading_does(
    server_store: Store, tmp_path: Path
) -> None:
    file = tmp_path / "campus.pmtiles"
    file.write_bytes(bytes(range(200)))
    settings = ApiSettings(host="0.0.0.0", dashboard=tmp_path / "none", map_tiles=MapTiles(pmtiles=file))
    with serving(server_store, settings) as server, server.client(Role.VIEWER) as client:
        assert client.get("/api/v1/map").json()["url"] == "map/tiles.pmtiles"
        part = client.get("/api/v1/map/tiles.pmtiles", headers={"range": "bytes=10-19"})
        with server.client() as stranger:
            assert stranger.get("/api/v1/map/tiles.pmtiles").status_code == 401
    assert (part.status_code, part.content) == (206, bytes(range(10, 20)))


@pytest.mark.parametrize(
    ("section", "words"),
    [
        ({"tiles": "ftp://x/{z}/{x}/{y}"}, "tiles"),
        ({"tiles": "https://x.org/tiles.png"}, "{z}"),
        ({"tiles": "https://x.org; script-src *//{z}/{x}/{y}"}, "tiles"),
        ({"pmtiles": "/not/there.pmtiles"}, "no file"),
        ({"pmtiles": __file__, "tiles": URL}, "exclude each other"),
    ],
)
def test_a_mistake_in_the_configuration_is_told(section: dict[str, str], words: str) -> None:
    with pytest.raises(ConfigError) as caught:
        check_config({"map": section}, "gcs.toml")
    assert "[map]" in str(caught.value)
    assert words in str(caught.value)
