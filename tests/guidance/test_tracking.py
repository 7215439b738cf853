"""Guidance on a point mass with lag, wind and an acceleration limit, in virtual time."""

import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gcs.guidance.reference import Point, SlotReference, slot_references
from gcs.guidance.tracking import DEFAULT_GAINS, approach, follow, holding_point_m, keep_velocity
from gcs.ports import UavTrack, VelocitySetpoint
from policy.world.motion import slot_motion

TICK_S, SLOT_S, ACCEL = 0.1, 15.0, 4.5


@dataclass
class LaggingMass:
    """Velocity follows the command within an acceleration limit and then a first-order lag; wind pushes."""

    place: list[float] = field(default_factory=lambda: [500.0, 500.0])
    vel: list[float] = field(default_factory=lambda: [0.0, 0.0])
    shaped: list[float] = field(default_factory=lambda: [0.0, 0.0])
    wind: tuple[float, float] = (0.0, 0.0)
    alt_m: float = 118.0
    lag_s: float = 0.4

    def __post_init__(self) -> None:
        self.shaped = list(self.vel)

    def fly(self, setpoint: VelocitySetpoint) -> None:
        north, east, down = setpoint.vel_ned_mps
        wanted = (east, north)
        change = math.hypot(wanted[0] - self.shaped[0], wanted[1] - self.shaped[1])
        share = min(1.0, ACCEL * TICK_S / change) if change > 0.0 else 0.0
        for axis in range(2):
            self.shaped[axis] += share * (wanted[axis] - self.shaped[axis])
            pushed = self.shaped[axis] + 0.05 * self.wind[axis]
            self.vel[axis] += TICK_S / self.lag_s * (pushed - self.vel[axis])
            self.place[axis] += self.vel[axis] * TICK_S
        self.alt_m -= down * TICK_S

    def track(self) -> UavTrack:
        return UavTrack(1, *self.place, self.alt_m, *self.vel, 0.0, 1.0, 0.0)


def reference(
    body: LaggingMass, vel: tuple[float, float], start_s: float = 0.0, accel: float = 0.95 * ACCEL
) -> SlotReference:
    here, now, goal = (np.array([pair]) for pair in (body.place, body.vel, vel))
    (path,) = slot_references(here, now, goal, max_accel_mps2=accel, slot_s=SLOT_S, start_s=start_s)
    return path


def fly_slot(body: LaggingMass, path: SlotReference, start_s: float = 0.0) -> None:
    for tick in range(round(SLOT_S / TICK_S)):
        body.fly(follow(body.track(), path, 120.0, start_s + tick * TICK_S, max_speed_mps=18.0, gains=DEFAULT_GAINS))


angles, speeds = st.floats(0.0, 2 * math.pi), st.sampled_from([0.0, 5.0, 10.0, 14.0, 18.0])


@settings(max_examples=60, deadline=None)
@example(turn=4.0, speed=18.0, before=0.0, wind=(5.0, 10.0))
@given(turn=angles, speed=speeds, before=speeds, wind=st.tuples(st.floats(-10, 10), st.floats(-10, 10)))
def test_the_slots_end_point_is_met(turn: float, speed: float, before: float, wind: tuple[float, float]) -> None:
    body = LaggingMass(vel=[0.0, before], wind=wind)
    path = reference(body, (speed * math.sin(turn), speed * math.cos(turn)))
    fly_slot(body, path)
    end = path.at(SLOT_S)
    most_m = max(10.0, math.hypot(*wind))  # in more than 10 m/s of wind a metre more for each m/s
    assert math.hypot(body.place[0] - end.east_m, body.place[1] - end.north_m) < most_m
    assert math.hypot(body.vel[0] - end.vel_east_mps, body.vel[1] - end.vel_north_mps) < 2.0, "leaves at speed"
    assert body.alt_m == pytest.approx(120.0, abs=0.3)


def test_errors_do_not_pile_up_from_slot_to_slot() -> None:
    body, misses = LaggingMass(wind=(6.0, -4.0)), []
    for slot in range(12):
        turn = 2.4 * slot
        path = reference(body, (18.0 * math.sin(turn), 18.0 * math.cos(turn)), slot * SLOT_S)
        fly_slot(body, path, slot * SLOT_S)
        end = path.at((slot + 1) * SLOT_S)
        misses.append(math.hypot(body.place[0] - end.east_m, body.place[1] - end.north_m))
    assert max(misses) < 10.0


def test_the_reference_is_the_worlds_motion() -> None:
    body = LaggingMass(vel=[3.0, -4.0])
    path = reference(body, (18.0, 0.0))
    for time_s in (0.0, 2.0, 3.7, 15.0):
        start, goal = np.array([3.0, -4.0]), np.array([18.0, 0.0])
        way, _ = slot_motion(start, goal, None, 0.95 * ACCEL, SLOT_S, np.array(time_s))
        point = path.at(time_s)
        assert (point.east_m - 500.0, point.north_m - 500.0) == pytest.approx(tuple(way), abs=0.02)


def test_a_turn_into_the_next_slot_is_flown_before_this_one_ends() -> None:
    body = LaggingMass(vel=[0.0, 18.0], wind=(4.0, 3.0))
    now, goal, end = (np.array([pair]) for pair in ((0.0, 18.0), (0.0, 18.0), (12.0, 6.0)))
    here = np.array([body.place])
    limits = {"max_accel_mps2": 0.95 * ACCEL, "slot_s": SLOT_S, "start_s": 0.0}
    (path,) = slot_references(here, now, goal, vel_end_mps=end, **limits)
    way, vel = slot_motion(now[0], goal[0], end[0], 0.95 * ACCEL, SLOT_S, np.asarray(SLOT_S))
    last = path.at(SLOT_S)
    assert (last.east_m - here[0, 0], last.north_m - here[0, 1]) == pytest.approx(tuple(way), abs=0.02)
    fly_slot(body, path)
    assert math.dist(body.place, (last.east_m, last.north_m)) < 10.0
    assert math.dist(body.vel, tuple(vel)) < 2.0


def test_after_its_end_the_reference_goes_on_and_before_its_start_it_waits() -> None:
    path = reference(LaggingMass(vel=[10.0, 0.0]), (10.0, 0.0), start_s=100.0)
    assert path.at(90.0) == path.at(100.0) == Point(500.0, 500.0, 10.0, 0.0)
    assert path.at(117.0).east_m == pytest.approx(500.0 + 170.0)
    assert path.delayed(5.0).at(120.0).east_m == pytest.approx(path.at(115.0).east_m)
    assert path.outline()[0] == (500.0, 500.0)
    assert path.outline()[-1][0] == pytest.approx(650.0)


def test_a_reference_keeps_what_it_was_made_from() -> None:
    """It is worked out when it is asked for, and a policy may use its arrays again for the next slot."""
    here, now, goal, end = (np.array([pair]) for pair in ((500.0, 500.0), (0.0, 18.0), (18.0, 0.0), (0.0, 9.0)))
    limits = {"max_accel_mps2": ACCEL, "slot_s": SLOT_S, "start_s": 0.0}
    (path,) = slot_references(here, now, goal, vel_end_mps=end, **limits)
    (same,) = slot_references(here, now, goal, vel_end_mps=end, **limits)
    before = [path.at(0.1 * tick) for tick in range(170)]
    for values in (here, now, goal, end):
        values[:] = -99.0
    assert [same.at(0.1 * tick) for tick in range(170)] == before


def test_uavs_of_a_fleet_have_references_of_their_own() -> None:
    rng = np.random.default_rng(4)
    arrays = [rng.normal(0.0, 9.0, (3, 2)) for _ in range(4)]
    limits = {"max_accel_mps2": ACCEL, "slot_s": SLOT_S, "start_s": 2.0}
    fleet = slot_references(*arrays[:3], vel_end_mps=arrays[3], **limits)
    for i, path in enumerate(fleet):
        (alone,) = slot_references(*(a[i : i + 1] for a in arrays[:3]), vel_end_mps=arrays[3][i : i + 1], **limits)
        assert [path.at(t) for t in (0.0, 3.3, 9.1, 16.9, 21.0)] == [alone.at(t) for t in (0.0, 3.3, 9.1, 16.9, 21.0)]
        assert path.outline() == alone.outline()


def test_approach_arrives_and_stays_in_wind() -> None:
    body = LaggingMass(wind=(8.0, 0.0))
    for _ in range(900):
        body.fly(approach(body.track(), (650.0, 420.0), 120.0, 10.0, DEFAULT_GAINS))
    assert math.hypot(body.place[0] - 650.0, body.place[1] - 420.0) < 1.0
    assert math.hypot(*body.vel) < 0.1


def test_the_holding_point_can_be_reached_without_turning_back() -> None:
    track = UavTrack(1, 0.0, 0.0, 100.0, 18.0, 0.0, 0.0, 0.0, 0.0)
    assert holding_point_m(track, 4.5) == pytest.approx((36.0, 0.0))


@given(vel=st.tuples(st.floats(-40, 40), st.floats(-40, 40)), alt=st.floats(-500, 500))
def test_limits_hold_and_the_nose_points_along_the_way(vel: tuple[float, float], alt: float) -> None:
    track = UavTrack(1, 0.0, 0.0, alt, 0.0, 0.0, 0.0, 0.7, 0.0)
    setpoint = keep_velocity(track, vel, 120.0, 18.0, DEFAULT_GAINS)
    north, east, down = setpoint.vel_ned_mps
    assert math.hypot(north, east) <= 18.0 + 1e-9
    assert abs(down) <= DEFAULT_GAINS.climb_mps + 1e-9
    if math.hypot(north, east) >= 1.0:
        assert setpoint.yaw_rad == pytest.approx(math.atan2(east, north))
    else:
        assert setpoint.yaw_rad == 0.7, "slow: the nose stays"
