"""Episodes flown by the mock's vehicles: its lock-step physics behind the interface of a slot. The one place of
``policy`` that starts the mock.
"""

from dataclasses import replace

import numpy as np

from policy.world.airspace import hits_obstacle, inside_area
from policy.world.arrays import FloatArray
from policy.world.motion import slot_motion
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState
from policy.world.transition import Outcome, serve
from sitl_mock.batch import BatchFleet
from sitl_mock.physics.fleet import TICK_S

PARTS = 15
"""Of a slot: how often a vehicle is told a velocity, and where the rules of the airspace are looked at."""


class MockPhysics:
    """One campaign at a time: vehicles with jerk, lean and drag, hovering at the launch points in slot 0."""

    def __init__(self) -> None:
        self._fleet: BatchFleet | None = None

    def __call__(
        self, scenario: Scenario, state: WorldState, action: JointAction, next_user_pos_enu_m: FloatArray, /
    ) -> tuple[WorldState, Outcome]:
        """As ``policy.world.transition.step``. Vehicles are led through the slot as the world's motion goes, by what
        they should have reached a second later; without a limit of acceleration the velocities of ``action`` are held.
        """
        if state.slot == 0 or self._fleet is None:
            self._fleet = BatchFleet(1, scenario.num_uavs, alt_m=scenario.altitude_m)
            self._fleet.reset(_north_east(state.uav_pos_enu_m)[None])
        before_j = self._fleet.used_j[0].copy()
        path_m = self._path_m(self._fleet, scenario, state, action)
        spent_j = np.where(state.uav_active, self._fleet.used_j[0] - before_j, 0.0)
        remaining_j = state.uav_energy_j - spent_j
        ran_empty = np.asarray(state.uav_active & (remaining_j <= 0.0))
        flying = np.asarray(state.uav_active & ~ran_empty)
        users, was_served = serve(scenario, state, path_m[-1], flying, next_user_pos_enu_m)
        outcome = Outcome(
            served=was_served,
            energy_j=spent_j,
            left_area=state.uav_active & ~np.all(inside_area(path_m, scenario), axis=0),
            hit_obstacle=state.uav_active & np.any(hits_obstacle(path_m, scenario), axis=0),
            ran_empty=ran_empty,
        )
        moved = replace(
            state,
            slot=state.slot + 1,
            uav_pos_enu_m=path_m[-1],
            uav_vel_enu_mps=_north_east(self._fleet.vel_ned_mps[0]),
            uav_energy_j=np.clip(remaining_j, 0.0, None),
            uav_active=flying,
            user_pos_enu_m=next_user_pos_enu_m,
            user_data_mb=users[0],
            user_aoi_slots=users[1],
        )
        return moved, outcome

    @staticmethod
    def _path_m(fleet: BatchFleet, scenario: Scenario, state: WorldState, action: JointAction) -> FloatArray:
        """Fly the slot: places [PARTS, U, 2] on the way, the last one at its end."""
        end_mps = action.end_vel_enu_mps
        _, led_mps = slot_motion(
            state.uav_vel_enu_mps[:, None],
            action.vel_enu_mps[:, None],
            None if end_mps is None else end_mps[:, None],
            scenario.max_accel_mps2,
            scenario.slot_s,
            np.linspace(0.0, scenario.slot_s, PARTS + 1)[1:],
        )
        led_mps = np.where(state.uav_active[:, None, None], led_mps, 0.0)
        command = np.zeros((1, scenario.num_uavs, 3))
        ticks = np.diff(np.linspace(0.0, scenario.slot_s / TICK_S, PARTS + 1).round().astype(int))
        places = []
        for index, part in enumerate(ticks):
            command[0, :, :2] = _north_east(led_mps[:, index])
            fleet.step(command, int(part))
            places.append(_north_east(fleet.pos_ned_m[0]))
        return np.stack(places)


def _north_east(vector: FloatArray) -> FloatArray:
    """The first two components the other way round: east, north <-> north, east."""
    return np.ascontiguousarray(vector[..., 1::-1])
