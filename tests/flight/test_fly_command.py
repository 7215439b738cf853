"""``gcs fly`` as a stranger sees it: a process, real sockets, the contract's files; and every refusal one line."""

import csv
import json
import math
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rich.progress import Progress

from gcs.__main__ import main
from gcs.cli.fly import _bar
from gcs.ports import CampaignSnapshot, CampaignState, FlightSnapshot

REPOSITORY = Path(__file__).resolve().parents[2]
MISSION = """
[campaign]
name = "short"
slots = 4
slot_s = 15.0
[area]
south_west = [40.4203, -86.93]
size_m = [1200.0, 1000.0]
[fleet]
uavs = 2
altitude_m = 60.0
max_speed_mps = 18.0
launch_m = [600.0, 500.0]
battery_mah = 4500
battery_v = 22.2
[users]
source = "walkers"
count = 12
collect_mbps = 0.02
[radio]
mcl_db = 117.0
[objective]
preset = "fresh"
[policy]
name = "random"
"""


def fly(*words: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "gcs", "fly", *words]
    return subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, timeout=170, check=False)


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    path = tmp_path / "short.toml"
    path.write_text(MISSION, encoding="utf-8")
    return path


@pytest.mark.flight
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_campaign_over_sockets_and_its_files(mission: Path, tmp_path: Path, flavour: str) -> None:
    files = {name: tmp_path / name for name in ("result.json", "way.csv", "report", "logs")}
    done = fly(
        str(mission), "--fleet", "mock", "--flavour", flavour, "--speedup", "max", "--json", str(files["result.json"]),
        "--trajectory", str(files["way.csv"]), "--report", str(files["report"]),
        "--tlog", str(files["logs"]),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    result = json.loads(files["result.json"].read_text())
    assert (result["mission"], result["policy"], result["uavs"], result["slots"]) == ("short", "random", 2, 4)
    assert set(result["violations"].values()) == {0}
    rows = list(csv.DictReader(files["way.csv"].read_text(encoding="utf-8").splitlines()))
    assert len(rows) == 5 * (2 + 12)
    ages = [float(row["aoi"]) for row in rows if row["kind"] == "user" and row["slot"] != "0"]
    assert result["episodic_aoi"] == pytest.approx(np.mean(ages)), "recomputed from the file alone"
    served = [row["served"] == "1" for row in rows if row["kind"] == "user" and row["slot"] != "0"]
    assert result["user_coverage"] == pytest.approx(np.mean(served))
    first = [row for row in rows if row["kind"] == "uav" and row["slot"] == "0"]
    assert all(math.hypot(float(r["east_m"]) - 600.0, float(r["north_m"]) - 500.0) < 10.0 for r in first)
    assert (files["report"] / "index.html").stat().st_size > 1000
    heard = {file.name: file.stat().st_size for file in files["logs"].rglob("*.tlog")}
    assert len(heard) == 2, heard
    assert min(heard.values()) > 10_000, "minutes of telemetry of each drone"
    assert "random" in done.stdout


@pytest.mark.flight
def test_the_reports_own_command_flies_the_same_campaign_again(mission: Path, tmp_path: Path) -> None:
    report, way = tmp_path / "report", tmp_path / "first.csv"
    outputs = ("--report", str(report), "--trajectory", str(way))
    first = fly(str(mission), "--fleet", "mock", "--speedup", "max", "--seed", "3", *outputs)
    assert first.returncode == 0, first.stderr
    document = json.loads((report / "report.json").read_text())
    assert [row["label"] for row in document["comparison"]] == ["random (dry run)", "random (dry run)"]
    words = shlex.split(document["provenance"]["repeat"])
    assert words[:5] == ["python", "-m", "gcs", "fly", "mission.toml"]
    mission.unlink()  # the report has its own
    command = [sys.executable, *words[1:], "--trajectory", "again.csv"]
    again = subprocess.run(command, cwd=report, capture_output=True, text=True, timeout=170, check=False)
    assert again.returncode == 0, again.stderr
    assert (report / "again.csv").read_text() == way.read_text()


@pytest.mark.parametrize(
    ("words", "part"),
    [
        (["nowhere.toml"], "nowhere.toml"),
        (["MISSION", "--policy", "nonsense"], "nonsense"),
        (["MISSION", "--speedup", "-3"], "neither max nor"),
        (["MISSION", "--speedup", "soon"], "neither max nor"),
        (["MISSION", "--drone", "1"], "SYSID=ADDRESS"),
        (["MISSION", "--drone", "1=udpout:127.0.0.1:9"], "needs 2 drones"),
        (["MISSION", "--drone", "1=udpout:127.0.0.1:9", "--fleet", "mock"], "exclude each other"),
        (["MISSION", "--drone", "1=udpout:127.0.0.1:9", "--speedup", "max"], "real time"),
        (["MISSION", "--drone", "1=udpout:127.0.0.1:8", "--drone", "1=udpout:127.0.0.1:9"], "given twice"),
        (["MISSION", "--drone", "1=radio:127.0.0.1:8", "--drone", "2=udpout:127.0.0.1:9"], "radio"),
        (["MISSION", "--drone", "1=serial:/dev/nowhere:57600", "--drone", "2=udpout:127.0.0.1:9"], "/dev/nowhere"),
        (["MISSION", "--keep"], "--serve"),
        (["MISSION", "--serve", "0.0.0.0:8080"], "API keys"),
        (["MISSION", "--serve", "nonsense"], "HOST:PORT"),
        (["MISSION", "--json", "/proc/nowhere/x.json"], "/proc/nowhere"),
        (["MISSION", "--wind-ms", "gale"], "gale"),
        (["MISSION", "--nonsense"], "nonsense"),
        ([], "MISSION.toml"),
    ],
)
def test_mistakes_are_one_line(mission: Path, words: list[str], part: str, capsys: pytest.CaptureFixture[str]) -> None:
    try:
        code = main(["fly", *[str(mission) if word == "MISSION" else word for word in words]])
    except SystemExit as exit_:
        code = int(exit_.code or 0)
    error = capsys.readouterr().err
    assert code == 2
    assert len(error.strip().splitlines()) == 1, error
    assert part in error


def test_help_names_every_option(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_:
        main(["fly", "--help"])
    assert exit_.value.code == 0
    text = capsys.readouterr().out
    for option in (
        "--fleet",
        "--drone",
        "--policy",
        "--speedup",
        "--report",
        "--json",
        "--trajectory",
        "--serve",
        "--keep",
    ):
        assert option in text


def test_a_campaign_that_a_slow_store_keeps_back_is_waited_for():
    with Progress(disable=True) as progress:
        show = _bar(progress, progress.add_task("launching", total=4))
        told = CampaignSnapshot("c", "short", "random", CampaignState.DONE, 4, 4, 15.0, 0.0)
        assert not show(FlightSnapshot(0.0, 1))
        assert show(FlightSnapshot(60.0, 600, campaign=told))
