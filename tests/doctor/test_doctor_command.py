"""``gcs doctor`` over a real mock drone, and as an operator sees it."""

import json
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from gcs.__main__ import main
from gcs.cli.mock_fleet import free_udp_ports


@pytest.fixture(scope="module")
def drone() -> Iterator[str]:
    """The address of a mock drone that flies in real time."""
    words = ["-m", "sitl_mock", "--count", "1", "--first-port", str(free_udp_ports(1)), "--ready-after-s", "0"]
    process = subprocess.Popen([sys.executable, *words], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    found = re.search(r"ready: (\S+)", process.stdout.readline())
    assert found
    yield found[1]
    process.kill()
    process.communicate()


def doctor(capsys: pytest.CaptureFixture[str], tmp_path: Path, *words: str) -> tuple[int, dict[str, dict]]:
    store = f"sqlite:///{tmp_path / 'gcs.db'}"
    code = main(["doctor", "--json", "--port", "0", "--store", store, *words])
    return code, {finding["check"]: finding for finding in json.loads(capsys.readouterr().out)}


def test_a_drone_that_is_there_is_heard(capsys: pytest.CaptureFixture[str], tmp_path: Path, drone: str) -> None:
    code, found = doctor(capsys, tmp_path, "--drone", f"1={drone}", "--listen-s", "30")
    assert found["drone 1"]["grade"] == "ok", found["drone 1"]
    assert "px4" in found["drone 1"]["found"]
    assert code == 0, [finding for finding in found.values() if finding["grade"] == "red"]


def test_a_drone_that_is_not_there_is_red(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    address = f"1=udpout:127.0.0.1:{free_udp_ports(1)}"
    code, found = doctor(capsys, tmp_path, "--drone", address, "--listen-s", "0.2")
    assert (code, found["drone 1"]["grade"]) == (1, "red")
    assert "is it on" in found["drone 1"]["remedy"]


def test_strangers_can_come_and_there_are_no_keys(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    code, found = doctor(capsys, tmp_path, "--host", "0.0.0.0")
    assert (code, found["keys"]["grade"]) == (1, "red")
    assert "keys add" in found["keys"]["remedy"]


def test_people_get_lines_with_what_to_do(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    code = main(["doctor", "--port", "0", "--store", f"sqlite:///{tmp_path / 'gcs.db'}"])
    out = capsys.readouterr().out
    assert code == 0, out
    assert re.search(r"^ok +python +3\.", out, re.MULTILINE)
    assert re.search(r"^caution +links +no drones.*\n +-> give --drone", out, re.MULTILINE)
    assert out.splitlines()[-1].startswith("fit to fly from (")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--config", "missing.toml"), "missing.toml"),
        (("--drone", "one"), "SYSID=ADDRESS"),
        (("--port", "99999"), "[server] port"),
        (("--listen-s", "-1"), "--listen-s"),
    ],
)
def test_mistakes_are_one_line(capsys: pytest.CaptureFixture[str], words: tuple[str, ...], said: str) -> None:
    code = main(["doctor", *words])
    err = capsys.readouterr().err
    assert (code, err.count("\n"), said in err) == (2, 1, True)
