"""The campaign on which every rival has to prove that it learns: one UAV, three users who stand, a known optimum."""

import numpy as np

from policy.world.actions import paper_actions
from policy.world.airspace import legal_moves
from policy.world.arrays import FloatArray
from policy.world.scenario import Area, Scenario
from policy.world.state import JointAction, WorldState, initial_state
from policy.world.transition import step

SLOTS = 30
USERS_M = np.array([[60.0, 60.0], [520.0, 120.0], [1300.0, 100.0]])
OPTIMUM = 106.0 / 36.0
"""Episodic AoI of the best campaign, by exhaustive search: ``make rivals`` searches anew."""


def tiny_scenario() -> Scenario:
    """A strip so narrow that diagonals leave it: few places, so that all ways of 30 slots can be searched.

    No two users are served at once, and the best patrol passes one of them twice as often as the others.
    """
    return Scenario(
        area=Area((0.0, 0.0), (1370.0, 180.0)),
        launch_enu_m=np.array([[820.0, 90.0]]),
        collect_mbps=np.full(3, 0.02),
        slots=SLOTS,
    )


def tiny_places() -> FloatArray:
    """[T+1, 3, 2]: nobody moves."""
    return np.tile(USERS_M, (SLOTS + 1, 1, 1))


def tiny_sampler(_: np.random.Generator) -> tuple[Scenario, FloatArray]:
    """Always the same episode."""
    return tiny_scenario(), tiny_places()


def best_episodic_aoi(scenario: Scenario, users_m: FloatArray) -> float:
    """Exhaustive search by the world's own transition: all sequences of the nine actions.

    Sequences that lead to the same place and the same ages go on alike, so only the cheapest of each is kept.
    """
    velocities = paper_actions(scenario.max_speed_mps)
    start = initial_state(scenario, users_m)
    places, ages, costs = start.uav_pos_enu_m[None], start.user_aoi_slots[None], np.zeros(1)
    for slot in range(scenario.slots):
        rows = places.shape[0]
        legal = legal_moves(places, np.zeros_like(places), velocities.vel_enu_mps, scenario)  # [S, 9]
        row, action = np.nonzero(legal)
        state = _states(scenario, slot, places[row], ages[row], users_m)
        joint = JointAction(velocities.heading_rad[action][:, None], velocities.speed_mps[action][:, None])
        after, _ = step(scenario, state, joint, np.broadcast_to(users_m, (row.size, *users_m.shape)))
        costs = costs[row] + after.user_aoi_slots.mean(axis=-1)
        places, ages, costs = _cheapest(after.uav_pos_enu_m, after.user_aoi_slots, costs)
        assert rows <= 10**6
    return float(costs.min() / scenario.slots)


def _states(scenario: Scenario, slot: int, places: FloatArray, ages: FloatArray, users_m: FloatArray) -> WorldState:
    rows, users = ages.shape
    return WorldState(
        slot=slot,
        uav_pos_enu_m=places,
        uav_vel_enu_mps=np.zeros_like(places),
        uav_energy_j=np.full((rows, 1), scenario.battery_j),
        uav_active=np.ones((rows, 1), dtype=np.bool_),
        user_pos_enu_m=np.broadcast_to(users_m, (rows, users, 2)),
        user_data_mb=np.zeros((rows, users)),
        user_aoi_slots=ages,
        user_active=np.ones((rows, users), dtype=np.bool_),
    )


def _cheapest(places: FloatArray, ages: FloatArray, costs: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    keys = np.concatenate((np.round(places[:, 0], 3), ages), axis=1)
    order = np.argsort(costs, kind="stable")
    _, first = np.unique(keys[order], axis=0, return_index=True)
    kept = order[first]
    return places[kept], ages[kept], costs[kept]
