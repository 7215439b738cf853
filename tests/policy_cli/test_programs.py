"""What all three programs do before they do anything."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import gcs.__main__
import policy.__main__
import sitl_mock.__main__

PROGRAMS = {"gcs": gcs.__main__.main, "policy": policy.__main__.main, "sitl-mock": sitl_mock.__main__.main}
VERSION = re.search(r'^version = "(.+)"', (Path(__file__).parents[2] / "pyproject.toml").read_text(), re.MULTILINE)


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_tells_its_version(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        PROGRAMS[name](["--version"])
    assert ended.value.code == 0
    assert VERSION is not None
    assert capsys.readouterr().out == f"{name} {VERSION[1]}\n"


def test_the_outline_of_gcs_is_that_of_its_commands() -> None:
    assert gcs.__main__.outline().format_help() == gcs.__main__.parser().format_help()


def test_a_word_that_is_no_command_is_told_with_those_that_are(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        gcs.__main__.main(["flie"])
    assert ended.value.code == 2
    assert "'fly'" in capsys.readouterr().err


def test_help_and_version_load_no_command() -> None:
    script = "import sys; from gcs.__main__ import outline; outline(); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert not {"numpy", "fastapi", "sqlalchemy", "gcs.cli.fly"} & set(done.stdout.split())
