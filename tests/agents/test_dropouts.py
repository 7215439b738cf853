"""The rest of a fleet goes on as well as if it had been planned for their number."""

import numpy as np
import pytest
from dropouts import kappas

from policy.mobility.walkers import generate_walkers
from policy.world.scenario import Area, Scenario

SIZE_M = (1600.0, 1200.0)
USERS = 40
SLOTS = 45


@pytest.mark.parametrize("policy", ["gcrl", "receding-horizon"])
@pytest.mark.parametrize("lost", [(1,), (0, 2)])
def test_what_is_left_serves_within_a_tenth_of_a_fresh_plan(policy: str, lost: tuple[int, ...]) -> None:
    scenario = Scenario(
        area=Area((40.42, -86.93), SIZE_M),
        launch_enu_m=np.tile([[800.0, 600.0]], (3, 1)),
        collect_mbps=np.full(USERS, 0.02),
        slots=SLOTS,
    )
    crowd = generate_walkers(USERS, SLOTS + 1, 15.0, SIZE_M, 3).pos_enu_m
    both = [kappas(scenario, crowd, policy, lost, 15, seed) for seed in range(2)]
    went_on, anew = np.mean(both, axis=0)
    assert went_on <= 1.10 * anew
    assert went_on > 1.0
