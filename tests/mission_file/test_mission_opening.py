"""Opening a campaign: users from traces and walkers, one collection rate each, and variants."""

import csv

import numpy as np
import pytest

from policy.mission_file import MissionError, open_campaign, parse_mission_text, vary


def with_trace(good: str, folder, *, users: int = 3, samples: int = 11) -> str:
    with (folder / "own.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["timestamp", "id", "y_distance", "x_distance"])
        for sample in range(samples):
            writer.writerows([15 * sample, user, 20.0 * user, 10.0 * user + sample] for user in range(users))
    return good.replace('source = "walkers"\ncount = 5', 'source = "trace"\ntrace = "own.csv"')


def test_a_trace_beside_the_mission(good, tmp_path):
    scenario, traces = open_campaign(parse_mission_text(with_trace(good, tmp_path), directory=tmp_path))
    assert traces is not None
    assert traces.pos_enu_m.shape == (11, 3, 2)
    assert traces.pos_enu_m[4, 2].tolist() == [24.0, 40.0]
    assert scenario.collect_mbps.tolist() == [0.02] * 3


def test_one_rate_a_user(good, tmp_path):
    text = with_trace(good, tmp_path).replace("[policy]", "collect_mbps = [0.1, 0.2, 0.3]\n[policy]")
    scenario, _ = open_campaign(parse_mission_text(text, directory=tmp_path))
    assert scenario.collect_mbps.tolist() == [0.1, 0.2, 0.3]
    wrong = parse_mission_text(text.replace("0.1, ", ""), origin="m.toml", directory=tmp_path)
    with pytest.raises(MissionError, match=r"^m\.toml:19: \[users\] collect_mbps: has 2 values for 3 users"):
        open_campaign(wrong)


def test_walkers_are_the_same_each_time_and_keep_out_of_obstacles(good):
    first, again = (open_campaign(parse_mission_text(good))[1] for _ in range(2))
    assert first is not None
    assert again is not None
    assert np.array_equal(first.pos_enu_m, again.pos_enu_m)
    other = open_campaign(parse_mission_text(good.replace("count = 5", "count = 5\nseed = 1")))[1]
    assert other is not None
    assert not np.array_equal(first.pos_enu_m, other.pos_enu_m)


def test_live_users_come_later(good):
    text = good.replace('source = "walkers"\ncount = 5', 'source = "live"\ncount = 7')
    scenario, traces = open_campaign(parse_mission_text(text))
    assert traces is None
    assert scenario.num_users == 7


@pytest.mark.parametrize(
    ("trace", "words"), [("absent.csv", "not found in"), ("short.csv", "fly fewer slots"), ("words.csv", "header")]
)
def test_a_trace_that_cannot_be_used_names_key_and_line(good, tmp_path, trace, words):
    with_trace(good, tmp_path, samples=5)
    (tmp_path / "own.csv").rename(tmp_path / "short.csv")
    (tmp_path / "words.csv").write_text("hello\nworld\n")
    text = good.replace('source = "walkers"\ncount = 5', f'source = "trace"\ntrace = "{trace}"')
    text = text.replace("slots = 10", "slots = 60")
    mission = parse_mission_text(text, origin="m.toml", directory=tmp_path)
    with pytest.raises(MissionError, match=r"^m\.toml:18: \[users\] trace: ") as caught:
        open_campaign(mission)
    assert words in str(caught.value)


def test_an_area_without_room_for_walkers(good):
    wall = "[[0.0, 0.0], [1000.0, 0.0], [1000.0, 800.0], [0.0, 800.0]]"
    hole = good.replace("[[10.0, 10.0], [60.0, 10.0], [60.0, 60.0]]", wall).replace("[500.0, 400.0]", "[999.0, 799.0]")
    with pytest.raises(MissionError, match="inside obstacle"):
        parse_mission_text(hole)


def test_variants_are_checked_like_the_file(good):
    mission = parse_mission_text(good, origin="m.toml")
    wider = vary(mission, uavs=4, mcl_db=120.0, max_accel_mps2=4.5, slots=5)
    assert (wider.scenario.num_uavs, wider.scenario.radio.mcl_db, wider.scenario.slots) == (4, 120.0, 5)
    assert wider.scenario.max_accel_mps2 == 4.5
    assert vary(mission).scenario is mission.scenario
    with pytest.raises(MissionError, match=r"m\.toml:14: \[fleet\] altitude_m"):
        vary(mission, uavs=30)
    with pytest.raises(MissionError, match="nobody can be served"):
        vary(mission, mcl_db=80.0)


def test_own_launch_points_are_taken_in_order(good):
    mission = parse_mission_text(good.replace("[500.0, 400.0]", "[[500.0, 400.0], [520.0, 400.0]]"), origin="m.toml")
    assert vary(mission, uavs=1).scenario.launch_enu_m.tolist() == [[500.0, 400.0]]
    with pytest.raises(MissionError, match="2 different points, too few for 3 UAVs"):
        vary(mission, uavs=3)
