"""The server's configuration file."""

import argparse
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcs.cli.server_options import with_options
from gcs.config import ConfigError, ServerConfig, check_config, load_config

EXAMPLE = """
[server]
host = "0.0.0.0"
port = 9000
[store]
url = "postgresql://gcs@db/gcs"
[drones]
1 = "udpout:10.0.0.1:14540"
2 = "tcp:10.0.0.2:5760"
[policy]
url = "http://127.0.0.1:8090"
"""


def test_a_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "gcs.toml"
    path.write_text(EXAMPLE)
    config = load_config(path)
    assert (config.server.host, config.server.port, config.policy.url) == ("0.0.0.0", 9000, "http://127.0.0.1:8090")
    assert config.drones == {1: "udpout:10.0.0.1:14540", 2: "tcp:10.0.0.2:5760"}


def test_no_file_means_the_defaults() -> None:
    assert load_config(None) == ServerConfig()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[server]\nport = 70000", "[server] port"),
        ('[server]\nport = "8080"', "[server] port"),
        ("[server]\nprot = 1", "[server] prot: is no known key"),
        ("[servers]", "[servers]: is no known key"),
        ('[drones]\n251 = "udpin:0.0.0.0:1"', "[drones] 251"),
        ('[policy]\nurl = "ftp://x"', "[policy] url"),
        ("[server", "is no valid TOML"),
    ],
)
def test_a_mistake_is_named_in_one_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "gcs.toml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        load_config(path)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(st.sampled_from(["server", "port", "drones", "1", "store", "url"]), inner, max_size=4)
    ),
)


@given(JSON)
def test_rubbish_is_a_config_error_or_a_config(document: object) -> None:
    try:
        assert isinstance(check_config(document, "here"), ServerConfig)
    except ConfigError as error:
        assert str(error).startswith("here: ")  # noqa: PT017 either outcome is right


def test_one_drone_is_not_named_twice_and_a_folder_for_logs_may_be() -> None:
    given = argparse.Namespace(
        host=None, port=None, speedup=None, store=None, tlog=Path("logs"), drone=["2=udpout:a:1", "1=udpout:b:1"]
    )
    config = with_options(ServerConfig(drones={1: "udpout:c:1"}), given)
    assert (config.drones, config.link.tlog) == ({1: "udpout:b:1", 2: "udpout:a:1"}, Path("logs"))
    given.drone.append("2=udpout:d:1")
    with pytest.raises(ConfigError, match="2=udpout:a:1,udpout:d:1"):
        with_options(ServerConfig(), given)
