"""A bad link to every drone: the campaign ends, everybody lands, nothing is breached. Both flavours, both libraries."""

from pathlib import Path

import pytest
from chaos_flight import Chaos, fly
from fault_scripts import BAD_LINK, write

from gcs.ports import CampaignState


@pytest.mark.flight
@pytest.mark.timeout(600)
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_loss_jitter_duplicates_reordering_and_cuts_of_five_seconds(flavour: str, tmp_path: Path) -> None:
    """A cut of 5 s in every phase of each drone's flight, one of them one way only: PX4 falls out of OFFBOARD."""
    cuts = [(1, 100.0, "both"), (2, 130.0, "up"), (1, 160.0, "down"), (2, 190.0, "both"), (1, 215.0, "both")]
    faults = write(tmp_path / "faults.toml", [*BAD_LINK, *(("cut", i, at_s, 5.0, None, way) for i, at_s, way in cuts)])
    flown = fly(Chaos(flavour, faults, slots=6))
    assert flown.state is CampaignState.DONE, flown.story()
    assert flown.all_stand, flown.story()
    assert flown.breaches == 0
    assert "drone.release" not in flown.kinds(), "nobody was taken for a pilot"
    if flavour == "px4":
        assert "drone.regain" in flown.kinds()


@pytest.mark.flight
@pytest.mark.timeout(600)
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@pytest.mark.parametrize(("link", "speedup"), [("pymavlink", None), ("mavsdk", 5.0)])
def test_the_same_campaign_over_both_links(flavour: str, link: str, speedup: float | None) -> None:
    """MAVSDK reads in threads of its own and cannot be flown in lock step: there the wall clock counts."""
    ready = ("--ready-after-s", "3")
    flown = fly(Chaos(flavour, slots=2, altitude_m=30.0, link=link, speedup=speedup, extra=ready))
    assert flown.state is CampaignState.DONE, flown.story()
    assert flown.all_stand, flown.story()
    assert flown.breaches == 0
    assert [record.slot for record in flown.log.slots] == [0, 1, 2]
    assert max(vehicle.loss_ratio for vehicle in flown.snapshot.vehicles) < 0.05
    assert all(vehicle.answered_s is not None for vehicle in flown.snapshot.vehicles)
    assert all(vehicle.version for vehicle in flown.snapshot.vehicles)
