"""Own UAVs over one another: gusts may not bring them together, and every climb on its way counts."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from point_mass import PointMass, setpoint

from gcs.ports import UavTrack
from gcs.safety import judge as rules
from gcs.safety.acting import acting_climbs
from gcs.safety.envelope import Envelope
from gcs.safety.gate import GateAction, SafetyGate, Wish

ENVELOPE = Envelope(size_m=(600.0, 500.0))
TOO_NEAR_M, LEVEL_M = 5.0, 3.0  # gcs.safety.monitor's rule

drifts = st.floats(-0.35, 0.35)  # what Dryden's gusts of 10 m/s do to a height that nobody corrects
legs = st.tuples(drifts, drifts, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.booleans(), st.integers(10, 60))


@settings(max_examples=25, deadline=None)
@given(
    gap_m=st.floats(4.0, 8.0),
    beside_m=st.floats(0.0, 9.0),
    dead_ticks=st.integers(0, 4),
    legs=st.lists(legs, min_size=2, max_size=6),
)
def test_gusts_and_climbs_do_not_bring_together_who_are_over_one_another(
    gap_m: float, beside_m: float, dead_ticks: int, legs: list[tuple[float, float, float, float, bool, int]]
) -> None:
    gate = SafetyGate(ENVELOPE)
    over = PointMass(300.0, 250.0, 100.0 + gap_m, np.zeros(3), 4.5, dead_ticks)
    under = PointMass(300.0 + beside_m, 250.0, 100.0, np.zeros(3), 4.5, dead_ticks)
    for over.drift_mps, under.drift_mps, climb_over, climb_under, climbs, ticks in legs:
        for _ in range(ticks):
            wishes = [
                Wish(setpoint(1, down=-climb_over if climbs else 0.0), over.track(1)),
                Wish(setpoint(2, down=-climb_under if climbs else 0.0), under.track(2)),
            ]
            for body, sealed in zip((over, under), gate.judge(wishes), strict=True):
                north, east, down = sealed.setpoint.vel_ned_mps
                body.fly((east, north, -down), 0.1)
            apart_m = math.hypot(over.east_m - under.east_m, over.north_m - under.north_m)
            assert apart_m >= TOO_NEAR_M or abs(over.alt_m - under.alt_m) > LEVEL_M


def test_three_over_one_another_make_room() -> None:
    """The one in the middle can go nowhere; the outer two leave it."""
    gate = SafetyGate(ENVELOPE)
    bodies = [PointMass(300.0, 250.0, alt_m, np.zeros(3), 4.5, 3) for alt_m in (104.1, 100.0, 95.9)]
    for _ in range(100):
        safe = gate.judge([Wish(setpoint(i), body.track(i)) for i, body in enumerate(bodies, 1)])
        for body, sealed in zip(bodies, safe, strict=True):
            body.fly((0.0, 0.0, -sealed.setpoint.vel_ned_mps[2]), 0.1)
    assert bodies[0].alt_m > 104.3
    assert bodies[1].alt_m == pytest.approx(100.0, abs=0.1)
    assert bodies[2].alt_m < 95.7


def test_nobody_is_pushed_out_of_the_altitude_band() -> None:
    gate, highest_m = SafetyGate(ENVELOPE), ENVELOPE.max_alt_home_m
    over = PointMass(300.0, 250.0, highest_m - 0.1, np.zeros(3), 4.5, 3)
    under = PointMass(300.0, 250.0, highest_m - 4.2, np.zeros(3), 4.5, 3)
    for _ in range(150):
        safe = gate.judge([Wish(setpoint(1), over.track(1)), Wish(setpoint(2), under.track(2))])
        for body, sealed in zip((over, under), safe, strict=True):
            body.fly((0.0, 0.0, -sealed.setpoint.vel_ned_mps[2]), 0.1)
        assert over.alt_m < highest_m + 0.3
    assert over.alt_m - under.alt_m > 4.4


def test_a_drone_that_is_not_over_another_climbs_as_it_likes() -> None:
    gate = SafetyGate(ENVELOPE)
    high = UavTrack(1, 300.0, 250.0, 104.2, 0.0, 0.0, 0.0, 0.0, 0.0)
    low = UavTrack(2, 330.0, 250.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    safe = gate.judge([Wish(setpoint(1, down=0.4), high), Wish(setpoint(2, down=-0.4), low)])
    assert [sealed.action for sealed in safe] == [GateAction.PASSED, GateAction.PASSED]


def passes_over(climb_mps: float, ticks_since: int) -> bool:
    """Whether a UAV may fly over another one, 9 m below it, that was told to climb and then for some ticks to stay."""
    gate = SafetyGate(ENVELOPE)
    low = UavTrack(2, 300.0, 250.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    gate.judge([Wish(setpoint(2, down=-climb_mps), low)])
    for _ in range(ticks_since):
        gate.judge([Wish(setpoint(2), low)])
    high = UavTrack(1, 285.0, 250.0, 109.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    first, _ = gate.judge([Wish(setpoint(1, east=8.0), high), Wish(setpoint(2), low)])
    return first.action is GateAction.PASSED


@pytest.mark.parametrize("ticks_since", range(6))
def test_a_climb_counts_until_it_cannot_act_any_more(ticks_since: int) -> None:
    assert passes_over(0.0, ticks_since)
    assert passes_over(2.5, ticks_since) is (ticks_since >= ENVELOPE.reaction_s / ENVELOPE.tick_s)


def test_a_climb_of_one_that_its_autopilot_flies_now_is_forgotten_as_well() -> None:
    gate = SafetyGate(ENVELOPE)
    low = UavTrack(2, 300.0, 250.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    high = Wish(setpoint(1, east=8.0), UavTrack(1, 285.0, 250.0, 109.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    gate.judge([Wish(setpoint(2, down=-2.5), low)])
    passed = [gate.judge([high], [low])[0].action is GateAction.PASSED for _ in range(8)]
    assert passed == [False] * 4 + [True] * 4


@given(
    st.lists(st.tuples(*[st.floats(-3.0, 3.0)] * 3), min_size=1, max_size=15), st.floats(-3.0, 3.0), st.floats(8, 125)
)
def test_no_climb_that_may_act_leads_out_of_the_heights_counted_with(
    sent: list[tuple[float, float, float]], measured_mps: float, alt_m: float
) -> None:
    climbs, b = np.zeros(2), ENVELOPE.bounds()
    acting_climbs(np.array(sent), climbs)
    place = np.array([0.0, 0.0, alt_m, 0.0, 0.0, measured_mps])
    low_m, high_m = rules.heights_m(place, climbs[0], climbs[1], b)
    for climb_mps in (measured_mps, *(up for _, _, up in sent)):
        assert low_m <= alt_m + rules.levelled_off_m(climb_mps, b) <= high_m
