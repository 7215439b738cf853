"""A campaign in virtual time leaves telemetry behind, from the pads to the pads, and no setpoint comes later for it."""

from itertools import pairwise

import pytest
from test_campaign import Flight

from gcs.ports import CampaignState, FlightMode, TelemetrySample


def test_telemetry_goes_from_the_pads_to_the_pads_once_a_second() -> None:
    flight = Flight()
    flight.fly()
    kept = flight.journal.telemetry
    assert all(0.95 < b.time_s - a.time_s < 1.05 for a, b in pairwise(kept[:-1]))
    first, last = kept[0], kept[-1]
    slots = flight.journal.slots
    assert first.time_s < slots[0].time_s - 5.0
    assert last.time_s > slots[-1].time_s + 5.0
    assert not any(vehicle.armed for vehicle in (*first.vehicles, *last.vehicles))
    assert max(vehicle.alt_home_m or 0.0 for sample in kept for vehicle in sample.vehicles) == pytest.approx(120, abs=3)
    modes = {vehicle.mode for sample in kept for vehicle in sample.vehicles}
    assert {FlightMode.GUIDED, FlightMode.LAND} <= modes


def test_the_journal_is_asked_after_the_setpoints_of_the_tick_are_out() -> None:
    flight = Flight()
    flight.start()
    flight.until_state(CampaignState.FLYING)
    sent: list[int] = []

    def watched(campaign_id: str, sample: TelemetrySample) -> None:
        newest = max(vehicle.setpoint_times_s[-1] for vehicle in flight.vehicles)
        sent.append(round(1e3 * (sample.time_s - newest)))

    flight.journal.record_telemetry = watched  # type: ignore[method-assign]
    flight.until_slot(1)
    assert sent
    assert set(sent) == {0}
