"""Compile what is compiled once, before several test processes would each do it: numba keeps it between runs."""

import numpy as np

from gcs.safety.gate import compile_rules
from policy.agents.registry import make_agent
from policy.world.scenario import Area, Obstacle, Scenario

TOWER = Obstacle("tower", 200.0, ((300.0, 300.0), (340.0, 300.0), (340.0, 340.0), (300.0, 340.0)))


def main() -> None:
    """The gate's rules, and the planner's search for both kinds of motion, with and without learning."""
    compile_rules()
    for accel_mps2 in (np.inf, 4.5):
        scenario = Scenario(
            area=Area((40.42, -86.93), (600.0, 500.0), (TOWER,)),
            launch_enu_m=np.array([[100.0, 100.0], [120.0, 100.0]]),
            collect_mbps=np.full(5, 0.02),
            max_accel_mps2=float(accel_mps2),
        )
        for name in ("receding-horizon", "gcrl"):
            make_agent(name).reset(scenario, 0)


if __name__ == "__main__":
    main()
