"""The forecast is the evaluation of the same campaign with the vehicles' limits."""

from dataclasses import asdict, replace
from typing import Any

import pytest

from gcs.forecast.estimate import DryRunOrder, estimate
from policy.agents.registry import make_agent
from policy.evaluation.rollout import fly
from policy.mission_file import MissionError, open_campaign, parse_mission
from policy.mobility.feed import TraceFeed

MISSION: dict[str, Any] = {
    "campaign": {"name": "small", "slots": 5, "slot_s": 15.0},
    "area": {"south_west": [40.4203, -86.93], "size_m": [900.0, 700.0]},
    "fleet": {"uavs": 2, "launch_m": [400.0, 300.0]},
    "users": {"source": "walkers", "count": 6, "seed": 1},
    "policy": {"name": "random"},
}


def order(**change: Any) -> DryRunOrder:
    return DryRunOrder(MISSION | change, None, 10.0, 3.0)


def test_it_is_the_rollout_of_the_campaign_with_these_limits():
    told = estimate(order())
    mission = parse_mission(MISSION)
    scenario, traces = open_campaign(mission)
    assert traces is not None
    limited = replace(scenario, max_speed_mps=10.0).with_accel(3.0)
    flown = fly(limited, TraceFeed(traces).as_places(), make_agent("random"))
    assert told["metrics"] == asdict(flown.metrics)
    assert told["baseline"] == {"policy": "random", "metrics": told["metrics"]}
    assert told["violations"] == flown.violations
    assert 1.0 - sum(told["energy_left"]) / 2 == pytest.approx(flown.metrics.energy_ratio)


def test_the_series_ends_with_the_campaigns_metrics_and_counts_every_slot():
    slots: list[int] = []
    told = estimate(order(), lambda: slots.append(1))
    assert [point["slot"] for point in told["series"]] == [1, 2, 3, 4, 5]
    assert told["series"][-1]["metrics"] == pytest.approx(told["metrics"])
    assert told["series"][-1]["mean_aoi_slots"] == pytest.approx(told["metrics"]["final_aoi"])
    assert len(slots) == 5


def test_slower_vehicles_are_foretold_to_use_another_energy():
    slow = estimate(DryRunOrder(MISSION, None, 5.0, 3.0))
    assert slow["metrics"]["energy_ratio"] != estimate(order())["metrics"]["energy_ratio"]


def test_nobody_knows_where_live_users_will_be():
    with pytest.raises(MissionError, match="live users"):
        estimate(order(users={"source": "live", "count": 3}))
