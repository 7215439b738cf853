"""Every command of every page: its words are understood, and something runs it.

Blocks marked ``sh`` are run as they are (``test_pages_followed.py``). The commands of other blocks are too long, too
large, or want machines that a test has not. Their words are put to the real parser here, and :data:`RUN_BY` names the
test that runs the same command smaller.
"""

import argparse
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from fences import PAGES, ROOT, Command, commands, fences

import gcs.__main__
import policy.__main__
import sitl_mock.__main__

ALL = [command for page in PAGES for fence in fences(page) for command in commands(fence)]
PARSERS: dict[str, Callable[[], argparse.ArgumentParser]] = {
    "gcs": gcs.__main__.parser,
    "policy": policy.__main__.parser,
    "sitl-mock": sitl_mock.__main__.parser,
}
OURS = [command for command in ALL if command.program in PARSERS]
RUN_BY = {
    "gcs fly": "tests/flight/test_fly_command.py",
    "gcs serve": "tests/api/test_serve_command.py",
    "gcs replay": "tests/api/test_replay_command.py",
    "gcs recheck": "tests/flight/test_recheck.py",
    "gcs keys": "tests/api/test_serve_command.py",
    "gcs audit": "tests/api/test_audit_command.py",
    "gcs doctor": "tests/doctor/test_doctor_command.py",
    "gcs openapi": "tests/api/test_client.py",
    "gcs places": "tests/store/test_store_privacy.py",
    "policy evaluate": "tests/policy_cli/test_policy_command.py",
    "policy train": "tests/policy_cli/test_policy_train.py",
    "policy tables": "tests/evaluation/test_tables_command.py",
    "policy serve": "tests/service/test_policy_http.py",
    "sitl-mock": "tests/sitl_mock/test_mock_server.py",
}


def known(words: str) -> set[str]:
    """Subcommands of a program."""
    actions = PARSERS[words]()._actions
    return {name for a in actions if isinstance(a, argparse._SubParsersAction) for name in a.choices}


@pytest.mark.parametrize("command", OURS, ids=lambda command: f"{command.place} {command.program}")
def test_the_words_are_understood(command: Command, capsys: pytest.CaptureFixture[str]) -> None:
    code: object = 0
    try:
        PARSERS[command.program]().parse_args(list(command.arguments))
    except SystemExit as ended:  # after --help, and after a mistake
        code = ended.code
    assert code == 0, f"{command.place}: {capsys.readouterr().err}"


@pytest.mark.parametrize("command", OURS, ids=lambda command: f"{command.place} {command.program}")
def test_something_runs_it(command: Command) -> None:
    subcommand = f"{command.program} {command.arguments[0]}" if command.program != "sitl-mock" else command.program
    if subcommand in RUN_BY:
        assert (ROOT / RUN_BY[subcommand]).is_file()
        return
    assert "--print-completion" in command.arguments or list(
        (ROOT / "tests").rglob(f"test_*{command.arguments[0]}*.py")
    )


def test_no_command_is_overlooked() -> None:
    """The pages have commands of each kind; a harness that finds none would pass everything."""
    assert {command.program for command in ALL} >= {"gcs", "policy", "sitl-mock", "curl", "make", "docker", "pipx"}
    assert len(OURS) > 40


def test_makes_targets_exist() -> None:
    for command in (command for command in ALL if command.program == "make"):
        done = subprocess.run(
            ["make", "--dry-run", *command.arguments], cwd=ROOT, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{command.place}: {done.stderr}"


def test_compose_files_and_their_services_exist() -> None:
    asked = [command.arguments for command in ALL if command.program == "docker"]
    assert asked
    for arguments in asked:
        if arguments[0] != "compose":
            continue
        file = ROOT / arguments[arguments.index("-f") + 1]
        services = yaml.safe_load(file.read_text())["services"]
        if "run" in arguments:
            assert arguments[arguments.index("--rm") + 1] in services


def test_the_wheel_that_pages_name_is_this_version() -> None:
    version = re.search(r'^version = "(.+)"', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    assert version is not None
    wheels = {word for command in ALL for word in command.words if word.endswith(".whl")}
    assert {Path(wheel).name for wheel in wheels} == {f"uav_crowdsensing-{version[1]}-py3-none-any.whl"}
