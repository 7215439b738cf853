"""The training environment moves exactly as a MAVLink vehicle does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_station import VELOCITY, fly, station

from sitl_mock.batch import BatchFleet
from sitl_mock.physics import layout
from sitl_mock.physics.fleet import TICK_S
from sitl_mock.physics.vehicle import M600

_speed = st.floats(-18, 18).map(lambda value: float(np.float32(value)))  # setpoints travel as 32-bit floats


@settings(max_examples=8, deadline=None)
@given(st.lists(st.tuples(_speed, _speed), min_size=1, max_size=5))
def test_same_commands_same_motion(commands: list[tuple[float, float]]) -> None:
    """One MAVLink vehicle and one row of the batch, slot by slot, to 1e-9."""
    ground = station("ardupilot")
    fly(ground)
    batch = BatchFleet(3, 2, M600)
    body = ground.vehicle.body
    batch._fleet._state[:] = body._column[:, None]
    batch._fleet.set_limits(0, body.kind)
    start_j = float(batch.used_j[0, 0])
    for north, east in commands:
        ground.velocity(north, east, mask=VELOCITY)
        batch.step(np.tile([north, east, 0.0], (3, 2, 1)), round(1.0 / TICK_S))
        ground.run(1.0)
        np.testing.assert_allclose(batch.pos_ned_m[0, 0], body.pos_ned_m, atol=1e-9)
        np.testing.assert_allclose(batch.vel_ned_mps[0, 0], body.vel_ned_mps, atol=1e-9)
    assert float(batch.used_j[0, 0]) == pytest.approx(body._column[layout.USED_J], abs=1e-6)
    assert float(batch.used_j[0, 0]) > start_j


def test_slot_by_hand() -> None:
    """From 18 m/s north on: 15 s at 18 m/s are 270 m, and nothing drifts sideways."""
    batch = BatchFleet(2, 3)
    batch.reset(vel_ned_mps=np.broadcast_to([18.0, 0.0, 0.0], (2, 3, 3)))
    out = batch.step_slot(np.broadcast_to([18.0, 0.0, 0.0], (2, 3, 3)))
    assert out.shape == (2, 3, 3)
    np.testing.assert_allclose(out[..., 0], 270.0, atol=1.5)
    np.testing.assert_allclose(out[..., 1:], np.broadcast_to([0.0, -120.0], (2, 3, 2)), atol=1e-9)


def test_vehicles_do_not_touch_each_other() -> None:
    commands = np.random.default_rng(1).uniform(-18, 18, (4, 5, 3))
    commands[..., 2] = 0.0
    together = BatchFleet(4, 5).step_slot(commands).copy()
    alone = BatchFleet(1, 1)
    np.testing.assert_array_equal(alone.step_slot(commands[2:3, 3:4]), together[2:3, 3:4])
