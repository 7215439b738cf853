"""What methods may know of users' ways: the past as it was shown, and nothing after a gap."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from policy.model.history import StepHistory
from policy.model.states import last_steps_m
from policy.world.arrays import FloatArray
from policy.world.scenario import Area, Scenario
from policy.world.state import WorldState, initial_state

SCENARIO = Scenario(Area((0.0, 0.0), (900.0, 900.0)), np.zeros((1, 2)), np.full(3, 0.02))


def state_at(slot: int, pos_enu_m: FloatArray, away: tuple[int, ...] = ()) -> WorldState:
    active = np.array([user not in away for user in range(pos_enu_m.shape[0])])
    return replace(initial_state(SCENARIO, pos_enu_m), slot=slot, user_active=active)


@given(st.integers(1, 12), st.integers(0, 1000))
def test_it_holds_the_last_steps_newest_first(slots: int, seed: int) -> None:
    """Against the steps that training cuts out of whole traces (four of them)."""
    pos_enu_m = np.random.default_rng(seed).uniform(0.0, 900.0, (slots, 3, 2))
    history = StepHistory(4)
    for slot, place_m in enumerate(pos_enu_m):
        history.see(state_at(slot, place_m))
    np.testing.assert_allclose(history.steps_m, last_steps_m(pos_enu_m)[-1])
    assert history.known_slots.tolist() == [min(slots - 1, 4)] * 3


def test_who_was_away_has_no_way_between() -> None:
    history = StepHistory(3)
    here = np.full((3, 2), 100.0)
    history.see(state_at(0, here))
    history.see(state_at(1, here + 10.0, away=(1,)))
    history.see(state_at(2, here + 20.0))
    assert history.steps_m[1].tolist() == [[0.0, 0.0]] * 3
    assert history.steps_m[0].tolist() == [[10.0, 10.0], [10.0, 10.0], [0.0, 0.0]]
    assert history.known_slots.tolist() == [2, 0, 2]


def test_after_a_gap_or_with_other_users_it_begins_anew() -> None:
    history = StepHistory(2)
    here = np.full((3, 2), 100.0)
    for state in (state_at(0, here), state_at(1, here + 5.0), state_at(3, here + 50.0)):
        history.see(state)
    assert not history.steps_m.any()
    history.see(state_at(4, np.full((5, 2), 30.0)))
    assert history.steps_m.shape == (5, 2, 2)
    history.see(state_at(5, np.full((5, 2), 31.0)))
    history.forget()
    history.see(state_at(6, np.full((5, 2), 40.0)))
    assert not history.steps_m.any()
    assert history.known_slots.tolist() == [0] * 5
