"""The result object of the contract, and files that are whole or absent."""

import json
import os
import threading
from pathlib import Path

import numpy as np
import pytest

from policy.evaluation.files import OutputError, check_destination, write_text
from policy.evaluation.results import CampaignResult, write_result
from policy.evaluation.trajectory import UavRow, UserRow, trajectory_text
from policy.world.metrics import Metrics

ONE = Metrics(3.0, 0.9, 0.4, 0.8, 2.5)
TWO = Metrics(5.0, 0.7, 0.2, 0.6, 4.5)


def result(*metrics: Metrics, decision_ms: tuple[float, ...] = (1.0, 3.0)) -> CampaignResult:
    return CampaignResult("m", "random", 2, 117.0, 10, metrics, decision_ms, {"geofence": 1})


def test_one_seed_gives_plain_numbers():
    document = result(ONE).document()
    assert list(document) == [
        "mission", "policy", "uavs", "mcl_db", "slots", "seeds", "episodic_aoi", "data_collection_ratio",
        "user_coverage", "energy_ratio", "final_aoi", "decision_ms", "violations",
    ]  # fmt: skip
    assert (document["episodic_aoi"], document["final_aoi"], document["seeds"]) == (3.0, 2.5, 1)
    assert document["decision_ms"] == {"p50": 2.0, "p99": pytest.approx(2.98)}
    assert document["violations"] == {"geofence": 1, "separation": 0, "obstacle": 0, "battery": 0}


def test_several_seeds_give_mean_std_and_values():
    document = result(ONE, TWO).document()
    assert document["seeds"] == 2
    assert document["episodic_aoi"] == {"mean": 4.0, "std": 1.0, "values": [3.0, 5.0]}


def test_a_flight_without_timed_decisions_says_null(tmp_path):
    write_result(tmp_path / "r.json", result(ONE, decision_ms=()))
    assert json.loads((tmp_path / "r.json").read_text())["decision_ms"] == {"p50": None, "p99": None}


def test_trajectory_cells():
    text = trajectory_text(
        [
            UavRow(1, "1", 1.5, np.float64(-0.0), 359.9999999999, 18.0, 2.25),
            UserRow(1, "u 7", 0.1 + 0.2, 4.0, 2.0, 0.6, True),
        ]
    )
    assert text.splitlines() == [
        "slot,kind,id,east_m,north_m,heading_deg,speed_mps,energy_j,aoi,data_mb,served",
        "1,uav,1,1.5,0,0,18,2.25,,,",
        "1,user,u 7,0.3,4,,,,2,0.6,1",
    ]


def test_a_file_is_replaced_at_once_and_nothing_else_is_left(tmp_path):
    path = tmp_path / "r.txt"
    path.write_text("old")
    write_text(path, "new\n")
    assert path.read_text() == "new\n"
    assert [entry.name for entry in tmp_path.iterdir()] == ["r.txt"]


def test_devices_are_written_to_and_links_followed(tmp_path):
    device, target, link = tmp_path / "null", tmp_path / "target.txt", tmp_path / "link.txt"
    device.symlink_to("/dev/null")
    write_text(device, "gone\n")
    assert Path("/dev/null").is_char_device()
    target.write_text("old")
    link.symlink_to(target)
    write_text(link, "new\n")
    assert link.is_symlink()
    assert target.read_text() == "new\n"


def test_a_pipe_gets_the_text(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    write_text(pipe, "through\n")
    reader.join(timeout=10)
    assert read == ["through\n"]
    assert pipe.is_fifo()


@pytest.mark.parametrize("name", ["absent/r.json", ".", "a\0b", "x" * 5000 + "/y"])
def test_a_destination_that_cannot_be_written_is_found_out_first(tmp_path, name):
    with pytest.raises(OutputError):
        check_destination(tmp_path / name)
