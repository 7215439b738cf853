"""The motion model fed with the commands of real ArduCopter logs (docs/mock.md has the figures)."""

from __future__ import annotations

import pytest
from flight_logs import DEFAULT, LEAN_45, LOGS, fitted, judge

pytestmark = pytest.mark.skipif(not LOGS.is_dir(), reason="flight logs not at hand (UCS_FLIGHT_DIR)")


@pytest.mark.parametrize(("name", "limit_mps"), [(DEFAULT, 0.25), (LEAN_45, 0.15)])
def test_velocity_and_place_follow_the_log(name: str, limit_mps: float) -> None:
    found = judge(name)
    assert found.rms_mps <= limit_mps
    assert found.off_m <= 0.03 * found.flown_m
    assert found.off_m <= 10.0  # what it is in fact, on 4 km


@pytest.mark.parametrize(("fit_on", "judge_on"), [(DEFAULT, LEAN_45), (LEAN_45, DEFAULT)])
def test_a_log_that_was_not_used_for_fitting_is_followed_too(fit_on: str, judge_on: str) -> None:
    """Held out: fitted on one flight, judged on the other, whose lean limit is another."""
    found = judge(judge_on, fitted(fit_on))
    assert found.rms_mps <= 0.25  # the issue asks for 0.5
    assert found.off_m <= 0.005 * found.flown_m  # the issue asks for 3 %
