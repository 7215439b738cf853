"""Every move from every velocity, tabulated by the world's own motion, energy and airspace rules.

A slot is long enough to reach a commanded velocity (`reachable` says where it is not), so the velocity at a slot's
end is that of its move and a state of the search is a place and the index of the last move. Most moves end at the
velocity commanded. With inertia some end on the way into the next slot: a turn that two slots share costs half.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from policy.search.settings import SearchSettings, search_actions
from policy.world.actions import ActionSet
from policy.world.airspace import EDGE_TOLERANCE_M
from policy.world.arrays import BoolArray, FloatArray, IntArray
from policy.world.energy import used_energy_j
from policy.world.frames import heading_rad, velocity_enu_mps
from policy.world.motion import SAMPLES_PER_SLOT, change_time_s, slot_path_m, slot_times_s, stopping_point_m
from policy.world.scenario import Scenario
from policy.world.state import JointAction

BRAKING_SAMPLES = 1 + SAMPLES_PER_SLOT // 6  # as policy.world.airspace samples the way to rest

CRUISE_SPEEDS = 181
"""Of the greatest speed's range: 0.1 m/s apart at 18 m/s."""


class Walls(NamedTuple):
    """Where a UAV may not be, for the compiled kernel. O obstacles of at most C corners, N in all."""

    low_m: FloatArray  # [2] south-west corner of the area
    high_m: FloatArray  # [2] north-east corner
    margin_m: float  # kept from obstacles
    box_m: FloatArray  # [O, 4] east, north least and greatest, margin included
    first: np.ndarray[tuple[int, ...], np.dtype[np.int64]]  # [O + 1] where each obstacle's corners begin
    corner_m: FloatArray  # [N, 2]


class MoveTable(NamedTuple):
    """From the velocity of action i by action j: index [i, j]. P points of the way and of braking after it."""

    step_m: FloatArray  # [A, A, 2] displacement over the slot
    energy_j: FloatArray  # [A, A]
    reachable: BoolArray  # [A, A] the new velocity is reached within the slot
    box_m: FloatArray  # [A, A, 4] least and greatest east, north of the points
    points_m: FloatArray  # [A, A, P, 2] relative to the start
    cruise_j: FloatArray  # [C] of a slot at a steady speed that covers 0, 1, 2 .. x cruise_step_m
    cruise_step_m: float
    vel_mps: FloatArray  # [A, 2] commanded
    end_mps: FloatArray  # [A, 2] at which the slot is left
    end_index: IntArray  # [A] the same number for the same end_mps
    max_accel_mps2: float
    slot_s: float


class Rows(NamedTuple):
    """What the moves do from the velocity of action i and, in row A, from a UAV's present one."""

    step_m: FloatArray  # [A + 1, A, 2]
    energy_j: FloatArray  # [A + 1, A]
    reachable: BoolArray  # [A + 1, A]


@dataclass(frozen=True)
class Moves:
    """What does not change in a campaign."""

    actions: ActionSet  # what is commanded; several moves may command the same and end differently
    table: MoveTable
    walls: Walls
    serving_radius_m: float

    @cached_property
    def rows(self) -> Rows:
        """The table, and as row A what follows hovering: to be replaced where a UAV's own velocity matters."""
        table = self.table
        return Rows(
            step_m=np.concatenate((table.step_m, table.step_m[:1])),
            energy_j=np.concatenate((table.energy_j, table.energy_j[:1])),
            reachable=np.concatenate((table.reachable, table.reachable[:1])),
        )

    def command(self, moves: IntArray) -> JointAction:
        """What flies the moves [U]."""
        heading_rad_, speed_mps = self.actions.heading_rad[moves], self.actions.speed_mps[moves]
        if np.array_equal(self.table.end_mps, self.table.vel_mps):
            return JointAction(heading_rad_, speed_mps)
        end_mps = self.table.end_mps[moves]
        return JointAction(heading_rad_, speed_mps, heading_rad(end_mps), np.hypot(end_mps[:, 0], end_mps[:, 1]))


def make_moves(scenario: Scenario, settings: SearchSettings) -> Moves:
    """Tabulate the moves of one campaign."""
    actions, end_mps = _with_ends(search_actions(scenario, settings), scenario, settings)
    vel = actions.vel_enu_mps
    slots = end_mps[:, None, :], vel[None, :, :], end_mps[None, :, :]
    step_m, energy_j = tabulate(scenario, *slots)
    points_m = _points_m(scenario, *slots)
    change_s = change_time_s(slots[0], slots[1], scenario.max_accel_mps2)
    reachable = change_s + change_time_s(vel, end_mps, scenario.max_accel_mps2) <= scenario.slot_s
    reachable[:, 0] = True  # braking always is, by the choice of the fastest move
    box_m = np.concatenate((points_m.min(axis=-2), points_m.max(axis=-2)), axis=-1)
    cruise_j, cruise_step_m = _cruise(scenario)
    table = MoveTable(
        step_m=step_m,
        energy_j=energy_j,
        reachable=reachable,
        box_m=box_m,
        points_m=points_m,
        cruise_j=cruise_j,
        cruise_step_m=cruise_step_m,
        vel_mps=vel,
        end_mps=end_mps,
        end_index=np.unique(end_mps.round(6), axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64),
        max_accel_mps2=float(scenario.max_accel_mps2),
        slot_s=float(scenario.slot_s),
    )
    return Moves(actions, table, make_walls(scenario), scenario.serving_radius_m)


def _with_ends(actions: ActionSet, scenario: Scenario, settings: SearchSettings) -> tuple[ActionSet, FloatArray]:
    """All moves' commands and the velocities [A, 2] at which they end; the plain ones first."""
    if math.isinf(scenario.max_accel_mps2) or not settings.end_turns_rad:
        return actions, actions.vel_enu_mps
    full = np.flatnonzero(actions.speed_mps == actions.speed_mps.max())
    which = np.concatenate((np.arange(actions.size), np.tile(full, len(settings.end_turns_rad))))
    turn_rad = np.concatenate((np.zeros(actions.size), np.repeat(settings.end_turns_rad, full.size)))
    commands = ActionSet(actions.heading_rad[which], actions.speed_mps[which])
    return commands, velocity_enu_mps(commands.heading_rad + turn_rad, commands.speed_mps)


def _cruise(scenario: Scenario) -> tuple[FloatArray, float]:
    speed_mps = np.linspace(0.0, scenario.max_speed_mps, CRUISE_SPEEDS)
    steady_mps = np.repeat(speed_mps[:, None], 2, axis=1)
    return np.asarray(used_energy_j(steady_mps, scenario.slot_s)), float(speed_mps[1] * scenario.slot_s)


def tabulate(
    scenario: Scenario, vel_from_mps: FloatArray, vel_to_mps: FloatArray, vel_end_mps: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Displacements [..., 2] and energies [...] of a slot, velocities [..., 2] broadcast against each other."""
    path_m, speeds_mps = _slot(scenario, vel_from_mps, vel_to_mps, vel_end_mps)
    return np.ascontiguousarray(path_m[..., -1, :]), np.asarray(used_energy_j(speeds_mps, scenario.slot_s))


def _points_m(
    scenario: Scenario, vel_from_mps: FloatArray, vel_to_mps: FloatArray, vel_end_mps: FloatArray
) -> FloatArray:
    """The way and the braking after it, seen from the start: [..., P, 2]."""
    path_m, _ = _slot(scenario, vel_from_mps, vel_to_mps, vel_end_mps)
    end_m = path_m[..., -1, :]
    to_rest_m = stopping_point_m(np.zeros_like(end_m), vel_end_mps, scenario.max_accel_mps2)
    braking_m = end_m[..., None, :] + slot_times_s(end_m, 1.0, BRAKING_SAMPLES)[:, None] * to_rest_m[..., None, :]
    return np.concatenate((path_m, braking_m), axis=-2)


def _slot(
    scenario: Scenario, vel_from_mps: FloatArray, vel_to_mps: FloatArray, vel_end_mps: FloatArray
) -> tuple[FloatArray, FloatArray]:
    start, goal, end = np.broadcast_arrays(vel_from_mps, vel_to_mps, vel_end_mps)
    return slot_path_m(np.zeros_like(goal), start, goal, scenario.max_accel_mps2, scenario.slot_s, end)


def make_walls(scenario: Scenario) -> Walls:
    """The area and the obstacles that reach up to the UAVs."""
    polygons = [np.asarray(o.polygon_m, dtype=np.float64) for o in scenario.blocking_obstacles]
    margin_m = scenario.obstacle_margin_m
    boxes = [np.concatenate((p.min(axis=0) - margin_m, p.max(axis=0) + margin_m)) for p in polygons]
    return Walls(
        low_m=np.full(2, -EDGE_TOLERANCE_M),
        high_m=np.asarray(scenario.area.size_m, dtype=np.float64) + EDGE_TOLERANCE_M,
        margin_m=margin_m,
        box_m=np.asarray(boxes, dtype=np.float64).reshape(-1, 4),
        first=np.cumsum([0, *(len(p) for p in polygons)], dtype=np.int64),
        corner_m=np.concatenate([np.zeros((0, 2)), *polygons]),
    )
