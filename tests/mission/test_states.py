"""The table of campaign states."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcs.mission.states import ENDINGS, FINAL, TRANSITIONS, IllegalTransitionError, Trigger, is_allowed, next_state
from gcs.ports import CampaignState


@given(state=st.sampled_from(list(CampaignState)), trigger=st.sampled_from(list(Trigger)))
def test_every_pair_is_in_the_table_or_fails_loudly(state: CampaignState, trigger: Trigger) -> None:
    if is_allowed(state, trigger):
        assert next_state(state, trigger) is TRANSITIONS[(state, trigger)]
    else:
        with pytest.raises(IllegalTransitionError, match=str(state)):
            next_state(state, trigger)


@pytest.mark.parametrize("state", sorted(FINAL))
def test_final_states_know_nothing(state: CampaignState) -> None:
    assert not any(is_allowed(state, trigger) for trigger in Trigger)


@pytest.mark.parametrize("state", sorted(set(CampaignState) - FINAL))
def test_every_other_state_has_a_way_to_an_end(state: CampaignState) -> None:
    reached, before = {state}, set()
    while reached != before:
        before = set(reached)
        reached |= {goal for (origin, _), goal in TRANSITIONS.items() if origin in reached}
    assert reached & FINAL


def test_no_way_from_flight_to_an_end_but_through_recovery() -> None:
    for (origin, _), goal in TRANSITIONS.items():
        if goal in FINAL and origin not in {CampaignState.DRAFT, CampaignState.READY}:
            assert origin is CampaignState.RECOVERING


def test_the_reason_of_a_recovery_decides_its_end() -> None:
    assert {next_state(CampaignState.RECOVERING, end) for end in ENDINGS.values()} == FINAL
