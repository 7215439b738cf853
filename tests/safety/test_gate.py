"""The gate in a kinematic simulation: whatever is asked, no UAV leaves the fence, hits a wall or meets another."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from point_mass import PointMass, setpoint

from gcs.ports import UavTrack, VelocitySetpoint
from gcs.safety import judge as rules
from gcs.safety.acting import still_acting
from gcs.safety.envelope import Envelope
from gcs.safety.gate import GateAction, SafetyGate, SealedSetpoint, Wish
from policy.world.geometry import distance_to_polygon_m

TOWER = ((200.0, 200.0), (260.0, 200.0), (260.0, 280.0), (200.0, 280.0))
ENVELOPE = Envelope(size_m=(600.0, 500.0), obstacles=(TOWER,), obstacle_names=("tower",))


def at(
    east: float, north: float, vel: tuple[float, float] = (0.0, 0.0), alt: float = 100.0, age: float = 0.0
) -> UavTrack:
    return UavTrack(1, east, north, alt, *vel, 0.0, 0.5, age)


@pytest.mark.parametrize(
    ("wish", "track", "action", "reason"),
    [
        (setpoint(north=10.0), at(400.0, 250.0), GateAction.PASSED, ""),
        (setpoint(north=40.0), at(400.0, 250.0), GateAction.SLOWED, "speed or climb limit"),
        (setpoint(down=-9.0), at(400.0, 250.0), GateAction.SLOWED, "speed or climb limit"),
        (setpoint(north=math.nan), at(400.0, 250.0), GateAction.HELD, "setpoint is not a number"),
        (setpoint(north=5.0), at(400.0, 250.0, age=1.5), GateAction.HELD, "position is too old to steer by"),
        (setpoint(north=5.0), None, GateAction.HELD, "position is too old to steer by"),
    ],
)
def test_table(wish: VelocitySetpoint, track: UavTrack | None, action: GateAction, reason: str) -> None:
    (safe,) = SafetyGate(ENVELOPE).judge([Wish(wish, track)])
    assert (safe.action, safe.reason) == (action, reason)
    assert all(math.isfinite(v) for v in safe.setpoint.vel_ned_mps)


@pytest.mark.parametrize(
    ("wish", "track", "reason"),
    [
        (setpoint(north=18.0), at(400.0, 474.0, (0.0, 11.0)), "geofence"),
        (setpoint(east=-18.0), at(30.0, 250.0, (-12.0, 0.0)), "geofence"),
        (setpoint(east=18.0), at(155.0, 240.0, (15.0, 0.0)), "obstacle"),
        (setpoint(east=10.0, north=10.0), at(190.0, 190.0, (5.0, 5.0)), "obstacle"),
    ],
)
def test_what_lies_ahead_within_the_stopping_distance(wish: VelocitySetpoint, track: UavTrack, reason: str) -> None:
    (safe,) = SafetyGate(ENVELOPE).judge([Wish(wish, track)])
    assert safe.action is not GateAction.PASSED
    assert safe.reason == reason


@pytest.mark.parametrize(
    ("track", "reason"),
    [(at(3.2, 250.0), "geofence"), (at(192.4, 240.0), "obstacle"), (at(400.0, 250.0), "separation")],
)
def test_who_hovers_at_a_margin_is_pushed_off_and_told_which(track: UavTrack, reason: str) -> None:
    beside = replace(at(400.0, 260.1), system_id=2)
    safe, _ = SafetyGate(ENVELOPE).judge([Wish(setpoint(), track), Wish(setpoint(2), beside)])
    assert (safe.action, safe.reason) == (GateAction.BENT, reason)


def test_who_drifts_into_a_margin_is_not_told_to_fly_faster_than_it_can() -> None:
    """Against the wind its lean is spent on speed, and it drifts east whatever it is told: only slower it can turn."""
    gate, drifting = SafetyGate(ENVELOPE), at(596.0, 250.0, vel=(1.2, 10.5))
    for _ in range(10):
        (safe,) = gate.judge([Wish(setpoint(north=17.2, east=-1.2), drifting)])
    north, east, _ = safe.setpoint.vel_ned_mps
    assert math.hypot(north, east) <= drifting.speed_mps
    assert safe.reason == "geofence"
    (free,) = SafetyGate(ENVELOPE).judge([Wish(setpoint(north=17.2, east=-1.2), replace(drifting, east_m=500.0))])
    assert free.action is GateAction.PASSED


def test_only_the_gate_makes_safe_setpoints() -> None:
    with pytest.raises(TypeError, match="SafetyGate"):
        SealedSetpoint(object(), setpoint(), GateAction.PASSED, "")


def test_climb_ends_below_the_ceiling() -> None:
    gate, body = SafetyGate(ENVELOPE), PointMass(400.0, 250.0, 100.0, np.zeros(3), 4.5, 3)
    for _ in range(400):
        (safe,) = gate.judge([Wish(setpoint(down=-3.0), body.track(1))])
        body.fly((0.0, 0.0, -safe.setpoint.vel_ned_mps[2]), 0.1)
    assert ENVELOPE.max_alt_home_m - 2.0 < body.alt_m <= ENVELOPE.max_alt_home_m + 0.2


wishes = st.lists(st.tuples(st.floats(-25.0, 25.0), st.floats(-25.0, 25.0), st.integers(5, 50)), min_size=1, max_size=5)


@settings(max_examples=20, deadline=None)
@given(
    plan=wishes,
    place=st.tuples(st.floats(10.0, 590.0), st.floats(10.0, 490.0)),
    dead_ticks=st.integers(0, 4),
    accel=st.floats(4.0, 5.0),
)
def test_no_breach_whatever_is_asked(
    plan: list[tuple[float, float, int]], place: tuple[float, float], dead_ticks: int, accel: float
) -> None:
    if float(distance_to_polygon_m(np.array(place), TOWER)) <= ENVELOPE.obstacle_margin_m:
        return
    gate, body = SafetyGate(ENVELOPE), PointMass(*place, 100.0, np.zeros(3), accel, dead_ticks)
    for north, east, ticks in plan:
        for _ in range(ticks):
            (safe,) = gate.judge([Wish(setpoint(north=north, east=east), body.track(1))])
            body.fly((safe.setpoint.vel_ned_mps[1], safe.setpoint.vel_ned_mps[0], 0.0), 0.1)
            assert 0.0 < body.east_m < 600.0
            assert 0.0 < body.north_m < 500.0
            assert float(distance_to_polygon_m(np.array([body.east_m, body.north_m]), TOWER)) > 0.0


@settings(max_examples=12, deadline=None)
@given(
    commands=st.lists(
        st.tuples(st.floats(-18.0, 18.0), st.floats(-18.0, 18.0), st.floats(-18.0, 18.0), st.floats(-18.0, 18.0)),
        min_size=1,
        max_size=5,
    ),
    gap_m=st.floats(12.0, 120.0),
)
def test_own_uavs_at_one_height_keep_apart(commands: list[tuple[float, float, float, float]], gap_m: float) -> None:
    gate = SafetyGate(Envelope(size_m=(600.0, 500.0)))
    first = PointMass(300.0, 250.0, 100.0, np.zeros(3), 4.5, 3)
    second = PointMass(300.0 + gap_m, 250.0, 100.0, np.zeros(3), 4.5, 3)
    for north_1, east_1, north_2, east_2 in commands:
        for _ in range(40):
            safe = gate.judge(
                [
                    Wish(setpoint(1, north_1, east_1), first.track(1)),
                    Wish(setpoint(2, north_2, east_2), second.track(2)),
                ]
            )
            for body, sealed in zip((first, second), safe, strict=True):
                body.fly((sealed.setpoint.vel_ned_mps[1], sealed.setpoint.vel_ned_mps[0], 0.0), 0.1)
            assert math.hypot(first.east_m - second.east_m, first.north_m - second.north_m) > 5.0


def test_layers_do_not_hinder_each_other() -> None:
    gate = SafetyGate(Envelope(size_m=(600.0, 500.0)))
    above = UavTrack(1, 300.0, 250.0, 120.0, 15.0, 0.0, 0.0, 0.0, 0.0)
    below = UavTrack(2, 320.0, 250.0, 115.0, -15.0, 0.0, 0.0, 0.0, 0.0)
    safe = gate.judge([Wish(setpoint(1, east=15.0), above), Wish(setpoint(2, east=-15.0), below)])
    assert [s.action for s in safe] == [GateAction.PASSED, GateAction.PASSED]


def test_outside_the_fence_the_way_back_is_open() -> None:
    gate, body = SafetyGate(ENVELOPE), PointMass(-20.0, 250.0, 100.0, np.zeros(3), 4.5, 3)
    for _ in range(300):
        (safe,) = gate.judge([Wish(setpoint(east=10.0), body.track(1))])
        body.fly((safe.setpoint.vel_ned_mps[1], safe.setpoint.vel_ned_mps[0], 0.0), 0.1)
    assert body.east_m > 50.0


def gate_that_told(*commands: tuple[float, float]) -> SafetyGate:
    """In the middle of the area, where all passes: each command (north, east) was told for one tick."""
    gate = SafetyGate(ENVELOPE)
    for north, east in commands:
        (sealed,) = gate.judge([Wish(setpoint(north=north, east=east), at(400.0, 250.0, vel=(0.0, 1.0)))])
        assert sealed.action is GateAction.PASSED
    return gate


def test_commands_that_the_vehicle_may_still_obey_count() -> None:
    """Told north at full speed, then east: until it is seen to turn it may go on north, so less is left to brake in."""
    north, east = (16.0, 0.0), (0.0, 12.0)
    differ = 0
    for place_m in np.arange(440.0, 495.0, 1.0):
        wish = Wish(setpoint(north=10.0), at(400.0, float(place_m), vel=(0.0, 1.0)))
        (turned,) = gate_that_told(*[north] * 3, *[east] * 2).judge([wish])
        (steady,) = gate_that_told(*[east] * 5).judge([wish])
        assert steady.action is GateAction.PASSED or turned.action is not GateAction.PASSED
        differ += steady.action is not turned.action
    assert differ > 0


@pytest.mark.parametrize("age_s", [1.5, 60.0, float("inf")])
def test_a_drone_that_is_seen_no_more_is_held_and_the_others_keep_clear(age_s: float) -> None:
    gate = gate_that_told((5.0, 0.0), (5.0, 0.0))
    lost = Wish(setpoint(1, north=5.0), at(400.0, 250.0, vel=(0.0, 5.0), age=age_s))
    near = Wish(setpoint(2, north=5.0), replace(at(400.0, 238.0, vel=(0.0, 5.0)), system_id=2))
    first, second = gate.judge([lost, near])
    assert first.action is GateAction.HELD
    assert second.action is not GateAction.PASSED  # 12 m behind one that may brake


def test_a_command_of_long_ago_is_forgotten() -> None:
    north, east = (16.0, 0.0), (0.0, 12.0)
    for place_m in np.arange(440.0, 495.0, 5.0):
        wish = Wish(setpoint(north=10.0), at(400.0, float(place_m), vel=(0.0, 1.0)))
        (turned,) = gate_that_told(*[north] * 3, *[east] * 5).judge([wish])
        (steady,) = gate_that_told(*[east] * 5).judge([wish])
        assert turned.action is steady.action


@given(st.lists(st.tuples(*[st.floats(-20.0, 20.0)] * 3), min_size=1, max_size=15))
def test_every_command_has_one_like_it_among_those_kept(sent: list[tuple[float, float, float]]) -> None:
    acting = np.zeros((rules.TOLD_MOST, 3))
    count = still_acting(np.array(sent), acting)
    assert 1 <= count <= rules.TOLD_MOST
    assert tuple(acting[0]) == sent[0]
    gaps = np.linalg.norm(np.array(sent)[:, None] - acting[None, :count], axis=-1).min(axis=1)
    if len(set(sent)) <= rules.TOLD_MOST:
        assert gaps.max() <= 0.5
