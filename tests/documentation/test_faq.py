"""The sentences of the page on errors are those that the programs say."""

import re
import socket
from pathlib import Path

import pytest
from fences import ROOT

from gcs.__main__ import main as gcs
from policy.__main__ import main as policy

TEXT = " ".join((ROOT / "docs" / "faq.md").read_text("utf-8").split())
QUOTED = re.findall(r"\*\*`(.+?)`\*\*", TEXT)
MISSION = """[campaign]
name = "first"
{wrong} = 4
slot_s = 15.0
[area]
south_west = [47.3960, 8.5400]
size_m = [1000.0, 800.0]
[fleet]
uavs = 1
launch_m = {launch}
[users]
source = "walkers"
"""


@pytest.fixture
def said(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """What a command says on stderr when it ends with 2."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("UCS_DATA_DIR", str(tmp_path))

    def command(main, *words: str) -> str:
        assert main(list(words)) == 2
        return capsys.readouterr().err.strip()

    return command


def quoted(pattern: str) -> str:
    """The page's one sentence that matches."""
    (found,) = [sentence for sentence in QUOTED if re.search(pattern, sentence)]
    return found


def test_a_port_in_use(said) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert said(gcs, "serve", "--port", str(port)).replace(str(port), "8080") == quoted("in use")


def test_no_keys(said) -> None:
    assert said(gcs, "serve", "--host", "0.0.0.0", "--port", "0") == quoted("no API keys")


def test_a_wrong_key_in_a_mission(said, tmp_path: Path) -> None:
    (tmp_path / "first.toml").write_text(MISSION.format(wrong="slots_s", launch=[500.0, 400.0]))
    assert said(policy, "evaluate", "first.toml").startswith("policy: " + quoted("unknown key"))


def test_a_launch_point_outside(said, tmp_path: Path) -> None:
    (tmp_path / "first.toml").write_text(MISSION.format(wrong="slots", launch=[500.0, 801.0]))
    assert said(policy, "evaluate", "first.toml").endswith(quoted("launch point"))


def test_a_trace_that_is_not_there(said) -> None:
    begun, ended = quoted("not found in").split("...")
    words = said(policy, "evaluate", "purdue")
    assert begun in words
    assert words.endswith(ended)


def test_an_unknown_policy(said) -> None:
    assert said(policy, "evaluate", "demo", "--policy", "gcr").startswith(quoted("unknown policy").removesuffix("..."))


def test_the_rest_are_told_by_their_own_tests() -> None:
    """Every quoted sentence is provoked above, or names the test of its words."""
    elsewhere = {
        "pre-flight: ": "tests/mission/test_preflight.py",
        "answered ": "tests/flight/test_campaign.py",
        "plan.late": "tests/mission",
    }
    provoked = ("in use", "no API keys", "unknown key", "launch point", "not found in", "unknown policy")
    for sentence in QUOTED:
        if any(words in sentence for words in provoked):
            continue
        (start,) = [words for words in elsewhere if sentence.startswith(words)]
        assert (ROOT / elsewhere[start]).exists()
