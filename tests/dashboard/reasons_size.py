"""What it takes to keep why each decision was made: bytes of JSON and ms a decision (docs/operator-page.md).

python tests/dashboard/reasons_size.py [--mission kaist] [--slots 20]
"""

import argparse
import json
import statistics
import sys
import time
from dataclasses import replace

import numpy as np
from moving_flight import Sight

from gcs.store.reasons import kept_reasons
from policy.agents.base import Agent, Decision
from policy.agents.registry import PolicyChoice
from policy.evaluation.rollout import fly
from policy.mission_file import load_mission, open_campaign
from policy.world.scenario import Scenario
from policy.world.state import WorldState

UAVS = (2, 11)


class Listening:
    """An agent whose reasons are kept as the store keeps them."""

    name = "listening"

    def __init__(self, agent: Agent) -> None:
        self._agent = agent
        self.kept_bytes: list[int] = []
        self.took_ms: list[float] = []

    def reset(self, scenario: Scenario, seed: int) -> None:
        self._agent.reset(scenario, seed)

    def decide(self, state: WorldState) -> Decision:
        decision = self._agent.decide(state)
        begun_s = time.perf_counter()
        kept = kept_reasons(decision.explanation)
        self.took_ms.append(1e3 * (time.perf_counter() - begun_s))
        self.kept_bytes.append(len(json.dumps(kept)))
        return decision


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mission", default="kaist")
    parser.add_argument("--slots", type=int, default=20)
    args = parser.parse_args()
    scenario, traces = open_campaign(load_mission(args.mission))
    assert traces is not None
    for uavs in UAVS:
        launch_m = np.repeat(scenario.launch_enu_m[:1], uavs, axis=0)
        for policy in ("gcrl", "receding-horizon"):
            agent = Listening(PolicyChoice(policy).build())
            fly(replace(scenario, launch_enu_m=launch_m, slots=args.slots), Sight(traces), agent)
            size, ms = statistics.mean(agent.kept_bytes), statistics.median(agent.took_ms)
            print(f"{uavs} UAVs x {scenario.num_users} users, {policy}: {size:.0f} bytes, {ms:.1f} ms a decision")
    return 0


if __name__ == "__main__":
    sys.exit(main())
