"""Which moments of a flight are kept: one a second, fewer when it is long or large, and the last one."""

from types import SimpleNamespace
from typing import Any, cast

from gcs.mission.campaign import Campaign
from gcs.mission.telemetry_sampler import TelemetrySampler
from gcs.ports import CampaignState, Journal, TelemetrySample, VehicleStatus

FLEET = {1: VehicleStatus(1), 2: VehicleStatus(2)}


class Kept:
    """The samples of a journal."""

    def __init__(self) -> None:
        self.times: list[tuple[str, float]] = []

    def record_telemetry(self, campaign_id: str, sample: TelemetrySample) -> None:
        assert sample.vehicles == tuple(FLEET.values())
        self.times.append((campaign_id, round(sample.time_s, 3)))


def campaign(state: CampaignState, campaign_id: str = "c") -> Campaign:
    return cast(Campaign, SimpleNamespace(order=SimpleNamespace(campaign_id=campaign_id), state=state))


def ticked(sampler: TelemetrySampler, flown: Campaign | None, first_s: float, seconds: float) -> None:
    for tick in range(round(10 * seconds)):
        sampler.tick(flown, FLEET, first_s + 0.1 * tick)


def sampling(**limits: Any) -> tuple[TelemetrySampler, Kept]:
    kept = Kept()
    return TelemetrySampler(cast(Journal, kept), **limits), kept


def test_one_a_second_while_a_campaign_is_in_the_air_and_once_when_it_is_over() -> None:
    sampler, kept = sampling()
    ticked(sampler, None, 0.0, 5.0)
    ticked(sampler, campaign(CampaignState.LAUNCHING), 5.0, 2.0)
    ticked(sampler, campaign(CampaignState.PAUSED), 7.0, 1.0)
    ticked(sampler, campaign(CampaignState.DONE), 8.05, 5.0)
    assert kept.times == [("c", 5.0), ("c", 6.0), ("c", 7.0), ("c", 8.05)]


def test_the_next_campaign_begins_at_once() -> None:
    sampler, kept = sampling()
    ticked(sampler, campaign(CampaignState.DONE), 0.0, 2.0)  # flown by a server before
    ticked(sampler, campaign(CampaignState.FLYING, "a"), 2.0, 0.2)
    ticked(sampler, campaign(CampaignState.FLYING, "b"), 2.2, 0.2)
    assert kept.times == [("a", 2.0), ("b", 2.2)]


def test_a_long_flight_of_many_is_kept_in_wider_steps() -> None:
    sampler, kept = sampling(budget=6)
    ticked(sampler, campaign(CampaignState.FLYING), 0.0, 21.0)
    assert [at_s for _, at_s in kept.times] == [0.0, 1.0, 2.0, 4.0, 6.0, 8.0, 12.0, 16.0, 20.0]


def test_a_stall_is_not_made_up_for() -> None:
    sampler, kept = sampling()
    ticked(sampler, campaign(CampaignState.FLYING), 0.0, 0.1)
    ticked(sampler, campaign(CampaignState.FLYING), 30.0, 1.5)
    assert len(kept.times) <= 4
