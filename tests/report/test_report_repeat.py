"""What a report says about flying again, and the lines that it sets beside the flight."""

import hashlib
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcs.report.paper_row import paper_rows
from gcs.report.repeat import digests, mission_as_flown, mission_toml, provenance
from policy.mission_file import load_mission, parse_mission, vary
from policy.model.checkpoint import find_checkpoint
from policy.world.metrics import Metrics

KEYS = st.text("abcdefgh_", min_size=1, max_size=8)
VALUES = st.recursive(
    st.booleans() | st.integers(-(2**40), 2**40) | st.floats(allow_nan=False) | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=12,
)


@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)  # a busy machine, not the data
@given(st.dictionaries(KEYS, VALUES, max_size=5))
def test_a_document_survives_the_way_through_toml(document):
    assert tomllib.loads(mission_toml(document)) == document


def test_null_is_a_key_left_out():
    assert tomllib.loads(mission_toml({"a": None, "b": {"c": None, "d": 1}})) == {"b": {"d": 1}}


def test_the_mission_names_the_policy_that_flew():
    mission = load_mission("demo")
    again = parse_mission(tomllib.loads(mission_toml(mission_as_flown(mission, "random", None))), origin="again")
    assert again.policy == "random"
    assert again.scenario.area.obstacles == mission.scenario.area.obstacles


def test_digests_are_those_of_the_trace_and_the_network(tmp_path: Path):
    trace = tmp_path / "purdue_59.csv"
    trace.write_bytes(b"id,timestamp\n")
    mission = replace(load_mission("purdue"), directory=tmp_path)
    graph = find_checkpoint(None).graph
    found = digests(mission, "gcrl", None)
    assert found == {
        "purdue_59.csv": hashlib.sha256(b"id,timestamp\n").hexdigest(),
        graph.name: hashlib.sha256(graph.read_bytes()).hexdigest(),
    }
    assert digests(load_mission("demo"), "random", None) == {}


def test_provenance_has_versions_machine_and_sources():
    found = provenance(load_mission("demo"), policy="random", checkpoint=None, seed=3, repeat="fly")
    assert {"python", "uav-crowdsensing", "numpy", "pymavlink"} <= set(found.versions)
    assert "cores" in found.machine
    assert (found.seed, found.repeat, found.mission["policy"]) == (3, "fly", {"name": "random"})


@pytest.mark.parametrize(("name", "aoi"), [("purdue", 3.400), ("ncsu", 7.999), ("kaist", 2.748)])
def test_the_papers_campaigns_stand_beside_the_papers_figures(name: str, aoi: float):
    (row,) = paper_rows(load_mission(name))
    assert row.metrics.episodic_aoi == aoi
    assert row.final_aoi is None


def test_other_campaigns_do_not():
    assert paper_rows(load_mission("demo")) == ()
    for other in ({"uavs": 3}, {"mcl_db": 119.0}, {"slots": 60}):
        assert paper_rows(vary(load_mission("purdue"), **other)) == ()


def test_a_row_with_everything_has_a_final_aoi():
    row = paper_rows(load_mission("purdue"))[0]
    assert replace(row, metrics=Metrics(1.0, 1.0, 1.0, 1.0, 2.0)).final_aoi == 2.0
