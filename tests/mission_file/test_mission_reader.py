"""Reading campaign files: what is accepted, and what every fault is called."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from policy.mission_file import MissionError, list_missions, load_mission, parse_mission, parse_mission_text
from policy.world.channel import Radio
from policy.world.scenario import Objective


def test_the_smallest_mission_takes_the_papers_values(good):
    mission = parse_mission_text(good)
    scenario = mission.scenario
    assert mission.name == "small"
    assert (scenario.slots, scenario.slot_s, scenario.num_uavs) == (10, 15.0, 2)
    assert scenario.radio == Radio()
    assert scenario.objective == Objective()
    assert math.isinf(scenario.max_accel_mps2)
    assert scenario.battery_j == pytest.approx(359_640.0)
    assert scenario.launch_enu_m.tolist() == [[500.0, 400.0]] * 2
    assert scenario.collect_mbps.tolist() == [0.02] * 5
    assert mission.users.walkers == 5
    assert mission.preset == "fresh"
    assert mission.warnings == ()


def test_json_and_toml_give_the_same_mission(good):
    from_toml = parse_mission_text(good)
    from_json = parse_mission(tomllib.loads(good))
    assert np.array_equal(from_toml.scenario.launch_enu_m, from_json.scenario.launch_enu_m)
    assert from_toml.scenario.area == from_json.scenario.area
    assert from_toml.users == from_json.users


def test_every_key_of_the_contract_is_understood(tmp_path):
    text = """
[campaign]
name = "purdue"
slots = 120
slot_s = 15
[area]
south_west = [40.4203, -86.93]
size_m = [1667.0, 1222.0]
obstacles = [ { name = "tower", height_m = 130.0, polygon_m = [[100.0, 100.0], [160.0, 100.0], [160.0, 150.0]] } ]
[fleet]
uavs = 2
altitude_m = 120.0
max_speed_mps = 18.0
max_accel_mps2 = 4.5
launch_m = [[833.5, 611.0], [800.0, 600.0]]
battery_mah = 4500
battery_v = 22.2
layer_m = 10.0
[users]
source = "trace"
trace = "purdue_59.csv"
collect_mbps = [0.02, 0.04]
[radio]
mcl_db = 119.0
alpha_los_db = 84.0
beta_los = 1.6
alpha_nlos_db = 113.0
beta_nlos = 1.2
g_tx_db = 1.0
g_rx_db = 4.0
user_height_m = 1.8
device_height_m = 1.2
user_width_m = 0.4
blockers_per_m2 = 0.01
[objective]
preset = "balanced"
gamma = 0.9
c_collect = 2.0
c_aoi = 11.0
[policy]
name = "random"
"""
    mission = parse_mission_text(text, directory=tmp_path)
    scenario = mission.scenario
    assert scenario.max_accel_mps2 == 4.5
    assert scenario.layer_m == 10.0
    assert scenario.launch_enu_m.tolist() == [[833.5, 611.0], [800.0, 600.0]]
    assert scenario.collect_mbps.tolist() == [0.02, 0.04]
    assert scenario.radio == Radio(119.0, 84.0, 1.6, 113.0, 1.2, 1.0, 4.0, 1.8, 1.2, 0.4, 0.01)
    assert (scenario.objective.gamma, scenario.objective.c_aoi, scenario.objective.c_collect) == (0.9, 11.0, 2.0)
    assert scenario.objective.c_cover > 0.0
    assert scenario.objective.c_energy > 0.0
    assert mission.directory == tmp_path


def test_explicit_weights_override_the_preset(good):
    mission = parse_mission_text(good + '[objective]\npreset = "balanced"\nc_cover = 0.0\n')
    assert mission.scenario.objective.c_cover == 0.0
    assert mission.scenario.objective.c_energy > 0.0


FAULTS = [
    # (replaced, by, line or None, words of the complaint)
    ("slot_s = 15.0", "slots_s = 15.0", 4, 'unknown key; did you mean "slot_s"?'),
    ("[policy]", "[polcy]", 19, 'unknown section; did you mean "policy"?'),
    ("height_m = 130.0", "heigth_m = 130.0", 10, 'obstacles[1].heigth_m: unknown key; did you mean "height_m"?'),
    ('name = "small"\n', "", 1, "[campaign] name: key is missing"),
    ("slots = 10", "slots = 0", 3, "greater than or equal to 1, not 0"),
    ("slots = 10", "slots = 10.5", 3, "valid integer, not 10.5"),
    ("slots = 10", "slots = true", 3, "valid integer, not True"),
    ("slot_s = 15.0", "slot_s = -1.0", 4, "greater than or equal to 1"),
    ("[60.0, 10.0]", "[1.34e154, 10.0]", 9, "less than or equal to 1000000000"),  # its square is no number
    ("slot_s = 15.0", 'slot_s = "15"', 4, "valid number, not '15'"),
    ("slot_s = 15.0", "slot_s = nan", 4, "not nan"),
    ("[1000.0, 800.0]", "[1000.0, inf]", 7, "not inf"),
    ("[1000.0, 800.0]", "[1000.0]", 7, "at least 2 items"),
    ("[47.0, 8.0]", "[8.0, 190.0]", 6, "no [latitude, longitude]"),
    ("[500.0, 400.0]", "[500.0, 801.0]", 15, "launch point [500, 801] is outside the area of 1000 x 800 m"),
    ("[500.0, 400.0]", "[[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]", 15, "3 points for 2 UAVs"),
    ("[500.0, 400.0]", "[130.0, 120.0]", 15, 'inside obstacle "tower"'),
    ("[500.0, 400.0]", "[55.0, 20.0]", 15, 'inside obstacle "low"'),
    ("[500.0, 400.0]", "[170.0, 120.0]", 14, '120 m is not clear of obstacle "tower" (130 m high), 10.0 m from'),
    ("[160.0, 100.0], [160.0, 150.0]", "[160.0, 150.0], [160.0, 100.0]", 10, "crosses itself"),
    ("[60.0, 10.0], [60.0, 60.0]", "[60.0, 10.0], [30.0, 10.0]", 9, "encloses no area"),
    (
        "[[10.0, 10.0], [60.0, 10.0], [60.0, 60.0]]",
        "[[10.0, -10.0], [60.0, -10.0], [60.0, -60.0]]",
        9,
        "outside the area",
    ),
    ("uavs = 2", "uavs = 30", 14, "lowest at -25 m"),
    ("altitude_m = 120.0", "altitude_m = 5.0", 14, "greater than or equal to 10"),
    ("altitude_m = 120.0", "battery_mah = 10", 14, "empty before the last slot"),
    ("altitude_m = 120.0", "battery_mah = 0", 14, "greater than 0"),
    ("count = 5", "count = 5\ncollect_mbps = 0.0", 19, "nothing to collect"),
    ("count = 5", "count = 5\ncollect_mbps = [0.1, 0.2]", 19, "2 values for 5 users"),
    ("count = 5", 'count = 5\npreset = "campus-dens"', 19, 'did you mean "campus-dense"?'),
    ("count = 5", 'trace = "x.csv"', 18, 'has no meaning with source = "walkers"'),
    ('source = "walkers"\ncount = 5', 'source = "trace"', 16, "name the file"),
    ('"walkers"', '"runners"', 17, "'trace', 'walkers' or 'live', not 'runners'"),
    ('name = "random"', 'name = "randon"', 20, 'did you mean "random"?'),
    ('name = "random"', 'name = "gcrl"\ncheckpoint = "absent.safetensors"', 21, 'no file "absent.safetensors"'),
    ("[policy]", "[radio]\nmcl_db = 80.0\n[policy]", 20, "nobody can be served"),
    ("[policy]", "[radio]\ndevice_height_m = 2.0\n[policy]", 19, "heights must satisfy"),
    ("[policy]", '[objective]\npreset = "best"\n[policy]', 20, "'fresh' or 'balanced'"),
    ("[policy]", "[objective]\ngamma = 1.0\n[policy]", 20, "less than 1"),
]


@pytest.mark.parametrize(("old", "new", "line", "words"), FAULTS)
def test_each_fault_is_one_line_that_names_key_and_line(changed, old, new, line, words):
    with pytest.raises(MissionError) as caught:
        parse_mission_text(changed(old, new), origin="m.toml")
    message = str(caught.value)
    assert message.startswith(f"m.toml:{line}: ")
    assert words in message
    assert "\n" not in message


def test_a_json_document_names_the_key_without_a_line(good):
    document = tomllib.loads(good)
    document["fleet"]["uav"] = 3
    with pytest.raises(MissionError, match=r'^request: \[fleet\] uav: unknown key; did you mean "uavs"\?'):
        parse_mission(document, origin="request")


def test_several_faults_are_counted(changed):
    with pytest.raises(MissionError, match=r"\(and 1 more\)"):
        parse_mission_text(changed("slots = 10\nslot_s = 15.0", "slots = 0\nslot_s = 0.0"))


def test_a_battery_for_cautious_flying_only_is_a_warning(changed):
    mission = parse_mission_text(changed("altitude_m = 120.0", "battery_mah = 300"))
    assert len(mission.warnings) == 1
    assert "battery_mah" in mission.warnings[0]


def test_an_obstacle_across_the_edge_and_a_tall_one_far_from_launch_are_legal(changed):
    parse_mission_text(changed("[[10.0, 10.0], [60.0, 10.0]", "[[-10.0, 10.0], [60.0, 10.0]"))


def test_broken_toml_says_where(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text("[campaign\n")
    with pytest.raises(MissionError, match=r"broken\.toml: is no valid TOML: .*line 1"):
        load_mission(path)


def test_bytes_that_are_no_text(tmp_path):
    path = tmp_path / "bytes.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(MissionError, match="no UTF-8 text"):
        load_mission(path)


def test_a_missing_file_lists_what_there_is():
    with pytest.raises(MissionError, match=r"did you mean .*purdue\.toml"):
        load_mission("perdue")
    with pytest.raises(MissionError, match="is a folder"):
        load_mission(Path("missions"))
    with pytest.raises(MissionError, match="no such mission file"):
        load_mission("a\0b")


def test_a_folder_of_a_missions_name_is_not_in_the_way(tmp_path, monkeypatch):
    (tmp_path / "demo").mkdir()
    monkeypatch.chdir(tmp_path)
    assert load_mission("demo").name == "demo"


def test_the_shipped_missions_can_be_flown():
    shipped = list_missions()
    assert {"demo", "purdue", "ncsu", "kaist"} <= shipped.keys()
    for path in shipped.values():
        mission = load_mission(path)
        assert mission.scenario.num_uavs == 2
        assert mission.scenario.serving_radius_m == pytest.approx(226.0, abs=0.5)
        assert mission.warnings == ()


def test_a_checkpoint_beside_the_mission_is_found(changed, tmp_path):
    (tmp_path / "own.safetensors").write_bytes(b"x")
    text = changed('name = "random"', 'name = "gcrl"\ncheckpoint = "own.safetensors"')
    assert parse_mission_text(text, directory=tmp_path).checkpoint == str(tmp_path / "own.safetensors")
