"""A bad link to every drone: the campaign ends, everybody lands, nothing is breached."""

from pathlib import Path

import pytest
from chaos_flight import ended_well, fly

BAD_LINK = """
[[fault]]
kind = "loss"
at_s = 20.0
value = 0.3
[[fault]]
kind = "jitter"
at_s = 20.0
value = 0.3
[[fault]]
kind = "duplicate"
at_s = 20.0
value = 0.2
[[fault]]
kind = "cut"
vehicle = 1
at_s = 170.0
for_s = {cut_s}
"""


@pytest.mark.flight
@pytest.mark.parametrize(("flavour", "cut_s"), [("px4", 0.8), ("ardupilot", 2.5)])
def test_loss_jitter_duplicates_and_a_cut(flavour: str, cut_s: float, tmp_path: Path) -> None:
    """The cut is shorter than the autopilot's time-out: a longer one ends PX4's OFFBOARD, and the drone is released."""
    faults = tmp_path / "faults.toml"
    faults.write_text(BAD_LINK.format(cut_s=cut_s))
    snapshot, log, violations = fly(flavour, faults, slots=6)
    assert ended_well(snapshot), "; ".join(event.message for event in log.events)
    assert set(violations.values()) == {0}
