"""One campaign in the world model with the limits of the vehicles at hand, and what it scored slot by slot."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from policy.agents.base import Agent
from policy.agents.registry import PolicyChoice
from policy.evaluation.evaluate import policy_of
from policy.evaluation.rollout import CampaignRecord, fly
from policy.mission_file import MissionError, open_campaign, parse_mission
from policy.mobility.feed import TraceFeed
from policy.mobility.traces import UserTraces
from policy.world.metrics import campaign_metrics
from policy.world.scenario import Scenario

BASELINE = "random"


@dataclass(frozen=True)
class DryRunOrder:
    """What to fly, JSON-able. The limits are those that a flight now would plan with (``gcs.mission.order``)."""

    document: Mapping[str, Any]
    directory: str | None
    max_speed_mps: float
    max_accel_mps2: float


def estimate(order: DryRunOrder, on_slot: Callable[[], None] = lambda: None) -> dict[str, Any]:
    """The forecast, JSON-able. Raises MissionError and the policy's own errors, one line each."""
    directory = None if order.directory is None else Path(order.directory)
    mission = parse_mission(order.document, origin="dry run", directory=directory)
    scenario, traces = open_campaign(mission)
    if traces is None:
        raise MissionError("dry run: nobody knows yet where live users will be; give the mission a trace or walkers")
    limited = replace(scenario, max_speed_mps=order.max_speed_mps).with_accel(order.max_accel_mps2)
    flown = _flown(limited, traces, policy_of(mission).build(), on_slot)
    baseline = _flown(limited, traces, PolicyChoice(BASELINE).build())
    p50_ms, p99_ms = np.percentile(flown.decision_ms, [50.0, 99.0])
    return {
        "policy": mission.policy,
        "metrics": asdict(flown.metrics),
        "baseline": {"policy": BASELINE, "metrics": asdict(baseline.metrics)},
        "series": series(flown),
        "decision_ms": {"p50": float(p50_ms), "p99": float(p99_ms)},
        "violations": flown.violations,
        "energy_left": [float(left) for left in 1.0 - flown.energy_used_j / scenario.battery_j],
        "max_speed_mps": order.max_speed_mps,
        "max_accel_mps2": order.max_accel_mps2,
    }


def series(flown: CampaignRecord) -> list[dict[str, Any]]:
    """One point a slot: the metrics over all slots until then (Eq. 5-7), and the users' mean AoI at that moment."""
    data_mb = np.stack([state.user_data_mb for state in flown.states[1:]])
    energy_j = np.cumsum([outcome.energy_j for outcome in flown.outcomes], axis=0)  # [T, U]
    aoi_slots, served = flown.aoi_slots, flown.served
    return [
        {
            "slot": slot,
            "metrics": asdict(
                campaign_metrics(
                    flown.scenario, aoi_slots[:slot], data_mb[:slot], served[:slot], np.asarray(energy_j[slot - 1])
                )
            ),
            "mean_aoi_slots": float(np.mean(aoi_slots[slot - 1])),
            "decision_ms": flown.decision_ms[slot - 1],
        }
        for slot in range(1, len(flown.states))
    ]


def _flown(
    scenario: Scenario, traces: UserTraces, agent: Agent, on_slot: Callable[[], None] = lambda: None
) -> CampaignRecord:
    return fly(scenario, TraceFeed(traces).as_places(), agent, on_slot=on_slot)
