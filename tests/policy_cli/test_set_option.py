"""``--set NAME=VALUE``: a number of a method's settings from the command line."""

import json
from dataclasses import dataclass

import pytest

from policy.__main__ import main
from policy.cli.arguments import CommandError
from policy.cli.changes import changed
from policy.mission_file.shelf import find_mission


@dataclass(frozen=True)
class Settings:
    """A method's, in small."""

    steps: int = 3
    rate: float = 0.5
    seed: int = 0
    name: str = "usual"

    def __post_init__(self) -> None:
        if self.steps < 1:
            raise ValueError(f"steps must be positive, not {self.steps}")


def test_each_change_takes_the_place_of_what_was_there():
    assert changed(Settings(), ["steps=5", "rate=2"]) == Settings(steps=5, rate=2.0)
    assert isinstance(changed(Settings(), ["rate=2"]).rate, float)
    assert changed(Settings(steps=7), []) == Settings(steps=7)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        (["stepz=5"], "--set stepz: no such setting; choose one of: rate, steps$"),
        (["seed=1"], "--set seed: no such setting; choose one of: rate, steps$"),
        (["name=other"], "no such setting"),
        (["steps"], "must be NAME=VALUE, such as --set rate=0.5"),
        (["steps=2.5"], "--set steps: '2.5' is not a whole number"),
        (["rate="], "--set rate: '' is not a number"),
        (["rate=nan"], "--set rate: nan is not finite"),
        (["steps=4", "steps=5"], "--set steps: given twice"),
        (["steps=0"], "steps must be positive, not 0"),
    ],
)
def test_what_cannot_be_set_says_why_and_what_can(changes, told):
    with pytest.raises(CommandError, match=told):
        changed(Settings(), changes, keep=("seed",))


def test_a_rival_learns_with_what_was_set_and_resumes_with_the_same_only(capsys, tmp_path):
    pytest.importorskip("torch")
    mission = tmp_path / "brief.toml"
    mission.write_text(find_mission("demo").read_text().replace("slots = 60 ", "slots = 2 "))
    begin = ["train", str(mission), "--policy", "aoi-drqn", "--episodes", "1", "--out", str(tmp_path)]
    begin += ["--set", "hidden=8"]
    assert main([*begin, "--set", "n_step=2"]) == 0
    settings = json.loads((tmp_path / "card.json").read_text())["settings"]
    assert (settings["hidden"], settings["n_step"]) == (8, 2)
    capsys.readouterr()
    assert main([*begin, "--set", "n_step=4", "--resume"]) == 2
    told = capsys.readouterr().err.strip().splitlines()
    assert len(told) == 1
    assert "n_step 2 instead of 4" in told[0]


def test_a_name_that_no_setting_has_is_one_line(capsys, tmp_path):
    pytest.importorskip("torch")
    for policy, name in (("gcrl", "replay_episodes"), ("muzero", "simulations")):
        assert main(["train", "demo", "--policy", policy, "--out", str(tmp_path), "--set", "absent=1"]) == 2
        told = capsys.readouterr().err.strip().splitlines()
        assert len(told) == 1
        assert name in told[0]
