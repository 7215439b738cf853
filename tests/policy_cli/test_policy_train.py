"""``policy train``: what it draws its episodes from, and one short run from start to resume."""

import csv
import importlib
import json
import os
import signal

import numpy as np
import pytest

from policy.__main__ import main
from policy.cli.episodes import episode_sampler
from policy.mission_file import MissionError, load_mission, open_campaign, parse_mission_text, vary

MISSION = """\
[campaign]
name = "own"
slots = 4
slot_s = 15.0
[area]
south_west = [47.0, 8.0]
size_m = [800.0, 600.0]
[fleet]
uavs = 2
launch_m = [400.0, 300.0]
[users]
source = "trace"
trace = "own.csv"
collect_mbps = [0.01, 0.02, 0.03, 0.04, 0.05, 0.06]
[policy]
name = "random"
"""


def own_trace(folder) -> None:
    rng = np.random.default_rng(0)
    with (folder / "own.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["id", "timestamp", "x_distance", "y_distance"])
        for sample in range(5):
            writer.writerows([user, 15 * sample, *rng.uniform(0.0, 600.0, 2)] for user in range(6))


def test_every_episode_has_another_crowd_of_the_missions_size():
    mission = vary(load_mission("demo"), slots=3)
    scenario, draw = episode_sampler(mission)
    rng = np.random.default_rng(1)
    (first, crowd), (second, other) = draw(rng), draw(rng)
    assert crowd.shape == other.shape == (4, scenario.num_users, 2)
    assert not np.array_equal(crowd, other)
    assert not np.array_equal(first.launch_enu_m, second.launch_enu_m)
    assert "walkers" in draw.description


def test_test_users_of_a_trace_are_never_trained_on(tmp_path):
    own_trace(tmp_path)
    mission = parse_mission_text(MISSION, directory=tmp_path)
    full, traces = open_campaign(mission)
    scenario, draw = episode_sampler(mission)
    assert traces is not None
    assert 0 < scenario.num_users < full.num_users
    episode, places = draw(np.random.default_rng(1))
    ids = [
        user
        for user in range(full.num_users)
        if any(np.array_equal(traces.pos_enu_m[:, user], places[:, k]) for k in range(places.shape[1]))
    ]
    assert len(ids) == places.shape[1] == episode.num_users
    assert set(episode.collect_mbps.tolist()) <= {float(full.collect_mbps[user]) for user in ids}


def test_live_users_cannot_be_trained_on():
    text = MISSION.replace('"trace"\ntrace = "own.csv"', '"live"').replace(
        "[0.01, 0.02, 0.03, 0.04, 0.05, 0.06]", "0.02"
    )
    with pytest.raises(MissionError, match="cannot be trained on"):
        episode_sampler(parse_mission_text(text))


def test_a_short_run_and_its_continuation(capsys, tmp_path):
    pytest.importorskip("torch")
    own_trace(tmp_path)
    (tmp_path / "own.toml").write_text(MISSION)
    out = tmp_path / "out"
    arguments = ["train", str(tmp_path / "own.toml"), "--out", str(out), "--seed", "1", "--episodes", "1"]
    arguments += ["--set", "n_step=2"]
    assert main(arguments) == 0
    assert json.loads((out / "card.json").read_text())["settings"]["n_step"] == 2
    assert main([*arguments, "--resume"]) == 0
    assert (out / "model.onnx").is_file()
    assert main(["evaluate", str(tmp_path / "own.toml"), "--policy", "gcrl", "--checkpoint", str(out)]) == 0
    assert "gcrl" in capsys.readouterr().out


def test_nothing_to_resume_is_one_line(capsys, tmp_path):
    pytest.importorskip("torch")
    assert main(["train", "demo", "--out", str(tmp_path / "new"), "--resume", "--episodes", "1"]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_an_interrupted_run_says_where_it_stopped_and_goes_on_there(capsys, tmp_path, monkeypatch):
    """Ctrl-C in the first of three episodes; the run resumed ends in the weights of one that was left alone."""
    pytest.importorskip("torch")
    own_trace(tmp_path)
    (tmp_path / "own.toml").write_text(MISSION)
    begin = ["train", str(tmp_path / "own.toml"), "--seed", "3", "--episodes", "3", "--physics", "mock"]
    collect = importlib.import_module("policy.training.api")
    flown = collect.fly_episode

    def interrupted(*arguments):
        os.kill(os.getpid(), signal.SIGINT)
        return flown(*arguments)

    with monkeypatch.context() as patched:
        patched.setattr(collect, "fly_episode", interrupted)
        assert main([*begin, "--out", str(tmp_path / "cut")]) == 2
    told = capsys.readouterr().err.strip()
    assert "stopped after episode 1" in told
    assert "--resume" in told
    assert len(told.splitlines()) == 1
    assert main([*begin, "--out", str(tmp_path / "cut"), "--resume"]) == 0
    assert main([*begin, "--out", str(tmp_path / "whole")]) == 0
    cut, whole = ((tmp_path / name / "checkpoint.safetensors").read_bytes() for name in ("cut", "whole"))
    assert cut == whole
    assert json.loads((tmp_path / "cut" / "card.json").read_text())["settings"]["physics"] == "mock"


def test_a_device_that_is_not_there_is_one_line(capsys, tmp_path):
    pytest.importorskip("torch")
    assert main(["train", "demo", "--out", str(tmp_path / "x"), "--episodes", "1", "--device", "cuda:7"]) == 2
    told = capsys.readouterr().err.strip()
    assert "cuda:7" in told
    assert len(told.splitlines()) == 1
