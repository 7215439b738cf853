"""The reward of a slot (Eq. 8) with the penalty r_t^- and the optional bonuses of the objective."""

from policy.world.arrays import Array, array_namespace
from policy.world.scenario import Scenario
from policy.world.state import WorldState
from policy.world.transition import Outcome


def reward(scenario: Scenario, before: WorldState, after: WorldState, outcome: Outcome) -> Array:
    """r_t = r_t^+ + r_t^-: states and outcome of one slot -> [...]."""
    xp = array_namespace(before.user_aoi_slots)
    weights = scenario.objective
    active = xp.astype(before.user_active, before.user_aoi_slots.dtype)
    count = xp.clip(xp.sum(active, axis=-1), 1.0, None)
    freshness = weights.c_collect * (before.user_data_mb - after.user_data_mb) + weights.c_aoi * (
        before.user_aoi_slots - after.user_aoi_slots
    )
    bonus = weights.c_cover * xp.astype(outcome.served, active.dtype)
    gain = xp.sum((freshness + bonus) * active, axis=-1) / count
    spent = weights.c_energy * xp.sum(outcome.energy_j, axis=-1) / scenario.battery_j
    faults = outcome.left_area | outcome.hit_obstacle | outcome.ran_empty
    return gain - spent - weights.penalty * xp.sum(xp.astype(faults, active.dtype), axis=-1)
