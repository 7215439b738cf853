"""Campaigns in the store."""

from gcs.ports import CampaignState
from gcs.store.store import Store
from policy.mission_file import Mission


def test_a_created_campaign_is_ready_and_read_back(store: Store, mission: Mission) -> None:
    created = store.campaigns.create(mission, "ann")
    assert created.state is CampaignState.READY
    assert store.campaigns.get(created.id) == created
    assert created.document == {"campaign": {"name": "small"}}


def test_newest_first_and_paged(store: Store, mission: Mission) -> None:
    ids = [store.campaigns.create(mission, "ann").id for _ in range(3)]
    assert [c.id for c in store.campaigns.newest()] == ids[::-1]
    assert [c.id for c in store.campaigns.newest(limit=1, offset=1)] == [ids[1]]


def test_a_state_is_set_only_from_the_expected_one(store: Store, campaign_id: str) -> None:
    assert store.campaigns.set_state(campaign_id, CampaignState.READY, CampaignState.ABORTED, "never flown")
    assert not store.campaigns.set_state(campaign_id, CampaignState.READY, CampaignState.FLYING, "")
    campaign = store.campaigns.get(campaign_id)
    assert campaign is not None
    assert (campaign.state, campaign.reason) == (CampaignState.ABORTED, "never flown")


def test_unfinished_are_those_in_the_air_when_the_server_stopped(store: Store, mission: Mission) -> None:
    ids = {state: store.campaigns.create(mission, "ann").id for state in CampaignState}
    for state, campaign_id in ids.items():
        store.campaigns.set_state(campaign_id, CampaignState.READY, state, "")
    flown = {CampaignState.LAUNCHING, CampaignState.FLYING, CampaignState.PAUSED, CampaignState.RECOVERING}
    assert {c.state for c in store.campaigns.unfinished()} == flown


def test_an_unknown_campaign_is_none(store: Store) -> None:
    assert store.campaigns.get("nothing") is None
