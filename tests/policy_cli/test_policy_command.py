"""Conduct of the command: exit codes, one line on stderr, files whole or absent."""

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from policy.__main__ import main


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    try:
        code = main(arguments)
    except SystemExit as stop:
        code = int(stop.code or 0)
    captured = capsys.readouterr()
    return code, captured.out, captured.err


FAULTS = [
    ([], "COMMAND"),
    (["fly"], "invalid choice"),
    (["evaluate"], "MISSION.toml"),
    (["evaluate", "nowhere.toml"], "no such mission file"),
    (["evaluate", "demo", "--policy", "randon"], 'did you mean "random"?'),
    (["evaluate", "demo", "--policy", "muzero"], "comes without a trained network"),
    (["evaluate", "demo", "--policy", "muzero", "--checkpoint", "absent"], "no such file"),
    (["evaluate", "demo", "--policy", "random", "--checkpoint", "x"], "takes no checkpoint"),
    (["evaluate", "demo", "--policy", "gcrl", "--checkpoint", "absent.safetensors"], "absent.safetensors"),
    (["evaluate", "demo", "--seeds", "0"], "not between 1 and 1000"),
    (["evaluate", "demo", "--seeds", "two"], "no whole number"),
    (["evaluate", "demo", "--mcl-db", "nan"], "not between"),
    (["evaluate", "demo", "--mcl-db", "80"], "nobody can be served"),
    (["evaluate", "demo", "--uavs", "40"], "raise altitude_m"),
    (["evaluate", "demo", "--slots", "2000"], "battery"),
    (["evaluate", "demo", "--json", "absent/r.json"], "there is no folder absent"),
    (["evaluate", "demo", "--trajectory", "."], "is a folder"),
    (["evaluate", "demo", "--frobnicate"], "unrecognized arguments"),
    (["train", "demo"], "--out"),
    (["train", "demo", "--out", "d", "--episodes", "-1"], "not between"),
    (["train", "demo", "--out", "d", "--policy", "random"], "does not learn"),
    (["train", "demo", "--out", "d", "--policy", "muzer"], 'did you mean "muzero"?'),
    (["train", "demo", "--out", "d", "--device", "abacus"], "--device abacus"),
    (["serve", "--port", "70000"], "not between"),
    (["serve", "--policy", "none"], "unknown policy"),
    (["serve", "--checkpoint", "x"], "--checkpoint needs --policy"),
    (["serve", "--host", "no.such.host.invalid"], "no address of this machine"),
]


@pytest.mark.parametrize(("arguments", "words"), FAULTS)
def test_a_wrong_use_is_one_line_and_exit_2(capsys, monkeypatch, tmp_path, arguments, words):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, *arguments)
    assert code == 2
    assert out == ""
    assert len(err.strip().splitlines()) == 1
    assert words in err


@pytest.mark.parametrize("command", [[], ["evaluate"], ["train"], ["serve"]])
def test_help_exits_0(capsys, command):
    code, out, _ = run(capsys, *command, "--help")
    assert code == 0
    assert "usage: policy" in out


def test_evaluate_writes_what_was_asked_for(capsys, tmp_path):
    out, track = tmp_path / "r.json", tmp_path / "t.csv"
    code, table, err = run(
        capsys, "evaluate", "demo", "--policy", "random", "--slots", "5", "--uavs", "3", "--seeds", "2",
        "--accel", "4.5", "--json", str(out), "--trajectory", str(track),
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert "episodic AoI" in table
    document = json.loads(out.read_text())
    assert (document["mission"], document["uavs"], document["slots"], document["seeds"]) == ("demo", 3, 5, 2)
    assert len(document["episodic_aoi"]["values"]) == 2
    assert {entry.name for entry in tmp_path.iterdir()} == {"r.json", "t.csv", "t-seed1.csv"}
    assert len(track.read_text().splitlines()) == 1 + 6 * (3 + 60)


def test_nothing_is_written_when_the_run_fails(capsys, tmp_path):
    mission = tmp_path / "m.toml"
    mission.write_text(Path("missions/purdue.toml").read_text().replace("purdue_59.csv", "absent.csv"))
    code, _, err = run(capsys, "evaluate", str(mission), "--policy", "random", "--json", str(tmp_path / "r.json"))
    assert code == 2
    assert "m.toml:23: [users] trace" in err
    assert not (tmp_path / "r.json").exists()


def test_a_port_in_use_is_one_line(capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        code, out, err = run(capsys, "serve", "--port", str(taken.getsockname()[1]))
    assert (code, out) == (2, "")
    assert "choose another --port" in err
    assert len(err.strip().splitlines()) == 1


BLOCK_TORCH = """
import sys, importlib.abc
class Block(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "torch":
            raise ModuleNotFoundError("No module named 'torch'", name="torch")
sys.meta_path.insert(0, Block())
from policy.__main__ import main
raise SystemExit(main(sys.argv[1:]))
"""


def without_torch(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", BLOCK_TORCH, *arguments]
    return subprocess.run(command, check=False, capture_output=True, text=True, timeout=120)


@pytest.mark.parametrize("policy", ["random", "receding-horizon", "gcrl"])
def test_the_base_install_evaluates_without_torch(policy):
    arguments = ["evaluate", "demo", "--slots", "2", "--policy", policy]
    done = without_torch(*arguments)
    assert done.returncode == 0, done.stderr
    assert "episodic AoI" in done.stdout


def test_training_without_torch_says_what_to_install(tmp_path):
    arguments = ["train", "demo", "--out", str(tmp_path / "out")]
    done = without_torch(*arguments)
    assert done.returncode == 2
    assert "[train] extra" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
