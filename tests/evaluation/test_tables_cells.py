"""A cell is the campaign that ``evaluate`` flies, and its key changes with whatever could change it."""

import pickle
from dataclasses import replace

import pytest

from policy.agents.gcrl import GcrlSettings
from policy.evaluation.evaluate import evaluate
from policy.evaluation.results import METRIC_NAMES
from policy.evaluation.tables import cells
from policy.evaluation.tables.campuses import find_campus
from policy.evaluation.tables.cells import Point, cell_key, fly_task, make_task
from policy.evaluation.tables.methods import Absent, Method
from policy.mission_file import MissionError, vary

RANDOM = Method("random")


@pytest.fixture
def campus(tiny):
    found = find_campus(str(tiny), None)
    assert not isinstance(found, Absent)
    return found


@pytest.mark.parametrize("policy", ["random", "receding-horizon", "gcrl"])
def test_cells_equal_a_direct_evaluation(campus, policy):
    point = Point(campus.name, Method(policy), 3, 119.0)
    flown = [fly_task(make_task(campus, point, seed)) for seed in range(2)]
    direct = evaluate(vary(campus.mission, uavs=3, mcl_db=119.0), Method(policy).choice(), seeds=2).result
    for name in METRIC_NAMES:
        assert [cell["metrics"][name] for cell in flown] == [getattr(metrics, name) for metrics in direct.metrics]
    assert {key: sum(cell["violations"][key] for cell in flown) for key in direct.violations} == direct.violations
    assert (flown[0]["uavs"], flown[0]["mcl_db"], flown[0]["slots"]) == (direct.uavs, direct.mcl_db, direct.slots)


def test_paths_are_kept_of_the_flight_from_the_launch_point(campus):
    first, second = (fly_task(make_task(campus, Point(campus.name, RANDOM, 2, 117.0), seed)) for seed in (0, 1))
    assert "uav_paths_m" not in second
    assert len(first["uav_paths_m"]) == campus.slots + 1
    assert first["uav_paths_m"][0] == [[600.0, 450.0], [600.0, 450.0]]


def test_a_task_survives_pickling(campus):
    task = make_task(campus, Point(campus.name, RANDOM, 2, 117.0), 1)
    again = pickle.loads(pickle.dumps(task))
    assert fly_task(again)["metrics"] == fly_task(task)["metrics"]


def test_the_key_tells_all_inputs_apart(campus, tiny, monkeypatch):
    base = Point(campus.name, RANDOM, 2, 117.0)
    network = Method("gcrl", "somewhere", "aa", "gaussian")
    points = [
        base,
        replace(base, uavs=3),
        replace(base, mcl_db=117.5),
        replace(base, method=Method("receding-horizon")),
        replace(base, method=Method("random", options=(("keep_inside", False),))),
        replace(base, method=network),
        replace(base, method=replace(network, checkpoint_sha256="bb")),
        replace(base, method=replace(network, options=(("settings", GcrlSettings.paper(2)),))),
        replace(base, method=replace(network, options=(("settings", GcrlSettings.paper(3)),))),
    ]
    keys = [cell_key(campus, point, seed) for point in points for seed in (0, 1)]
    keys.append(cell_key(find_campus(str(tiny), 5), base, 0))
    tiny.write_text(tiny.read_text().replace("collect_mbps = 0.03", "collect_mbps = 0.04"))
    keys.append(cell_key(find_campus(str(tiny), None), base, 0))
    trace = tiny.with_name("tiny.csv")
    trace.write_text(trace.read_text().replace("1015,", "1016,", 1))
    keys.append(cell_key(find_campus(str(tiny), None), base, 0))
    monkeypatch.setattr(cells, "code_version", lambda policy: f"other sources of {policy}")
    keys.append(cell_key(campus, base, 0))
    assert len(set(keys)) == len(keys)


def test_the_same_weights_elsewhere_are_the_same_cell(campus):
    here, there = (Point(campus.name, Method("gcrl", place, "aa", "gaussian"), 2, 117.0) for place in ("here", "there"))
    assert cell_key(campus, here, 0) == cell_key(campus, there, 0)


def test_what_cannot_be_flown_so_is_said_before_anything_flies(campus):
    with pytest.raises(MissionError, match="raise altitude_m"):
        make_task(campus, Point(campus.name, RANDOM, 40, 117.0), 0)


def test_a_campus_without_its_trace_is_absent_and_a_wrong_one_an_error(tiny):
    tiny.with_name("tiny.csv").write_text("id,timestamp\n")
    with pytest.raises(MissionError, match=r"tiny\.csv"):
        find_campus(str(tiny), None).opened(2, 117.0)
    tiny.with_name("tiny.csv").unlink()
    absent = find_campus(str(tiny), None)
    assert isinstance(absent, Absent)
    assert "tiny.csv" in absent.reason
    assert str(tiny.parent) not in absent.reason  # results are published: no paths of this machine
