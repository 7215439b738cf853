"""What it costs when UAVs drop out in flight: the agent that goes on with the rest, against one that plans anew.

Both fly the same world from the same slot on. The new one has planned for the smaller fleet all along: it was shown
every slot before with the survivors alone, where they really were, so it knows as much of the users' ways.

python tests/agents/dropouts.py  # prints a Markdown table for the three campuses (UCS_DATA_DIR)
"""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from policy.agents.base import Agent
from policy.agents.registry import make_agent
from policy.evaluation.rollout import jittered
from policy.training.places import real_names, real_place
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState, initial_state
from policy.world.transition import step


def kappas(
    scenario: Scenario, pos_enu_m: FloatArray, policy: str, lost: Sequence[int], at_slot: int, seed: int
) -> tuple[float, float]:
    """Mean AoI from slot ``at_slot``, when UAVs ``lost`` drop out, to the end: (who goes on, who plans anew).

    ``pos_enu_m`` [T + 1, M, 2].
    """
    agent = make_agent(policy)
    agent.reset(scenario, seed)
    state, seen = initial_state(scenario, pos_enu_m[0]), []
    for slot in range(at_slot):
        seen.append(state)
        state, _ = step(scenario, state, agent.decide(state).action, pos_enu_m[slot + 1])
    active = state.uav_active.copy()
    active[list(lost)] = False
    went_on = _mean_aoi(agent, scenario, replace(state, uav_active=active), pos_enu_m)

    rest = np.flatnonzero(active)
    smaller = replace(scenario, launch_enu_m=scenario.launch_enu_m[rest])
    anew = make_agent(policy)
    anew.reset(smaller, seed)
    for earlier in seen:
        anew.decide(_only(earlier, rest))
    return went_on, _mean_aoi(anew, smaller, _only(state, rest), pos_enu_m)


def _only(state: WorldState, uavs: np.ndarray) -> WorldState:
    parts = ("uav_pos_enu_m", "uav_vel_enu_mps", "uav_energy_j", "uav_active")
    return replace(state, **{name: getattr(state, name)[uavs] for name in parts})


def _mean_aoi(agent: Agent, scenario: Scenario, state: WorldState, pos_enu_m: FloatArray) -> float:
    ages = []
    for slot in range(state.slot, scenario.slots):
        action: JointAction = agent.decide(state).action
        state, _ = step(scenario, state, action, pos_enu_m[slot + 1])
        ages.append(float(np.mean(state.user_aoi_slots)))
    return float(np.mean(ages))


def main() -> int:
    """Exit code 1 where going on costs more than 10 %."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--uavs", type=int, default=4)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--at-slot", type=int, default=40)
    parser.add_argument("--policy", default="gcrl")
    args = parser.parse_args()
    worst = 0.0
    print("| users | of | drop out | goes on | plans anew | more |\n| --- | --- | --- | --- | --- | --- |")
    for name in real_names():
        place = real_place(name)
        launch = np.repeat(place.scenario.launch_enu_m[:1], args.uavs, axis=0)
        scenario = replace(place.scenario, launch_enu_m=launch)
        for count in range(1, args.uavs):
            both = []
            for seed in range(args.seeds):
                lost = np.random.default_rng(seed).permutation(args.uavs)[:count]
                both.append(
                    kappas(jittered(scenario, seed), place.pos_enu_m, args.policy, lost.tolist(), args.at_slot, seed)
                )
            on, anew = np.mean(both, axis=0)
            worst = max(worst, on / anew - 1.0)
            print(f"| {name} | {args.uavs} | {count} | {on:.3f} | {anew:.3f} | {on / anew - 1.0:+.1%} |", flush=True)
    return int(worst > 0.10)


if __name__ == "__main__":
    sys.exit(main())
