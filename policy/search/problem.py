"""One slot's question to the search: where everybody is, what may be done first, what it costs."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from policy.search.moves import Moves, tabulate
from policy.search.settings import SearchSettings
from policy.world.airspace import hits_obstacle, inside_area, legal_moves
from policy.world.arrays import BoolArray, FloatArray, IntArray
from policy.world.motion import change_time_s, slot_path_m
from policy.world.scenario import Scenario
from policy.world.state import WorldState

VECTOR = 16
"""Users by which compiled loops step; those left over are taken singly, each as dear as a vector."""
SHARP_M = 1e-6
"""Where nothing blurs a user's place, the chance to be served falls from one to none within this."""
Float32Array = npt.NDArray[np.float32]


class Users(NamedTuple):
    """The users who take part, as the kernel reads them: ``present`` of them, then some of no weight that are always
    served, so that N fills whole vectors of the processor.
    """

    present: int
    east_m: Float32Array  # [H, N] predicted at the end of each slot
    north_m: Float32Array  # [H, N]
    aoi_slots: Float32Array  # [N] now
    weight: Float32Array  # [N] sums to 1
    inner_m: Float32Array  # [H, N] served for sure within
    fade_per_m: Float32Array  # [H, N] how fast the chance falls beyond


class Prices(NamedTuple):
    """The objective in slots of weighted mean AoI."""

    cover: float  # gained for serving all users for one slot
    energy: float  # per joule
    leaf: float  # per slot of AoI and metre beyond the serving radius: what a path leaves to be done
    end: float  # the same at the horizon's end: 0 where the campaign ends with it
    discount: float  # a slot
    last: float  # of ages at the horizon's end beside their own: above 0 where the campaign ends with it


class Effort(NamedTuple):
    """How wide to search."""

    beam: int  # K
    cell_m: float
    by_velocity: bool  # paths that arrive by different commands differ (finite acceleration)
    free_places: bool  # kept paths lie between the moves (polished)


class Start(NamedTuple):
    """One UAV now, and its moves: row i from the velocity of action i, row A from the present velocity. Those of U
    UAVs in one: each array has a leading [U].
    """

    pos_m: FloatArray  # [2]
    step_m: FloatArray  # [A + 1, A, 2]
    energy_j: FloatArray  # [A + 1, A]
    allowed: BoolArray  # [A + 1, A]; row A: legal here and now


@dataclass(frozen=True)
class Problem:
    """A slot's question. H slots of horizon, A moves, U UAVs, N users who take part."""

    scenario: Scenario
    moves: Moves
    state: WorldState
    settings: SearchSettings
    horizon_slots: int  # H, shorter near the campaign's end
    user_pos_enu_m: FloatArray  # [H, M, 2] predicted at the end of each slot
    users: Users
    prices: Prices
    effort: Effort
    starts: Start  # of all UAVs, each array with a leading [U]
    start_m: FloatArray  # [U, 2] as compiled code reads them: one layout, or it is compiled anew in flight
    start_mps: FloatArray  # [U, 2]

    def start(self, uav: int) -> Start:
        """One UAV's."""
        return Start(*(values[uav] for values in self.starts))

    @property
    def is_polished(self) -> bool:
        """Places of plans lie between the moves."""
        return self.settings.polish_sweeps > 0

    @property
    def planned(self) -> IntArray:
        """UAVs that fly."""
        return np.flatnonzero(self.state.uav_active)


def make_problem(
    scenario: Scenario,
    moves: Moves,
    state: WorldState,
    settings: SearchSettings,
    user_pos_enu_m: FloatArray | None = None,
    user_blur_m: FloatArray | None = None,
) -> Problem:
    """State without batch dimension; ``user_pos_enu_m`` [>= H, M, 2] predicted, None when they stay; ``user_blur_m``
    [>= H, M] how far predictions may be off, None: certain.
    """
    left = scenario.slots - state.slot
    horizon = min(settings.horizon_slots, left) if left > 0 else settings.horizon_slots
    if user_pos_enu_m is None:
        user_pos_enu_m = np.broadcast_to(state.user_pos_enu_m, (horizon, *state.user_pos_enu_m.shape))
    if user_pos_enu_m.shape[0] < horizon or user_pos_enu_m.shape[1:] != state.user_pos_enu_m.shape:
        raise ValueError(f"predicted places are {user_pos_enu_m.shape}, need [>= {horizon}, M, 2] for the state's M")
    starts = _starts(scenario, moves, state)
    return Problem(
        scenario=scenario,
        moves=moves,
        state=state,
        settings=settings,
        horizon_slots=horizon,
        user_pos_enu_m=user_pos_enu_m[:horizon],
        users=_users(scenario, moves.serving_radius_m, state, user_pos_enu_m[:horizon], user_blur_m, settings),
        prices=_prices(scenario, settings, float(moves.table.cruise_j[-1]), is_last=0 < left <= settings.horizon_slots),
        effort=Effort(
            settings.beam, settings.cell_m, math.isfinite(scenario.max_accel_mps2), settings.polish_sweeps > 0
        ),
        starts=starts,
        start_m=starts.pos_m,
        start_mps=np.array(state.uav_vel_enu_mps, dtype=np.float64, order="C"),
    )


def _starts(scenario: Scenario, moves: Moves, state: WorldState) -> Start:
    rows, vel, end_mps, uavs = moves.rows, moves.actions.vel_enu_mps, moves.table.end_mps, scenario.num_uavs
    start = Start(
        pos_m=np.array(state.uav_pos_enu_m, dtype=np.float64, order="C"),
        step_m=np.repeat(rows.step_m[None], uavs, axis=0),
        energy_j=np.repeat(rows.energy_j[None], uavs, axis=0),
        allowed=np.repeat(rows.reachable[None], uavs, axis=0),
    )
    if math.isfinite(scenario.max_accel_mps2):  # else the present velocity means nothing: any row is its own
        own = tabulate(scenario, state.uav_vel_enu_mps[:, None, :], vel[None], end_mps[None])
        start.step_m[:, -1], start.energy_j[:, -1] = own
    start.allowed[:, -1] = first_moves(scenario, state, vel, end_mps)
    return start


def first_moves(
    scenario: Scenario, state: WorldState, vel_command_mps: FloatArray, vel_end_mps: FloatArray
) -> BoolArray:
    """Moves (commanded and at the end [A, 2]; the first hovers) that each UAV may fly now, bool [U, A]: the world's
    legal ones, or else the way back.

    Wind or a late setpoint can leave a UAV outside or beside an obstacle, where no move is legal from its
    beginning on. Then those that end clear are allowed; failing these the one that ends nearest to the middle.
    """
    pos_m, vel_mps = state.uav_pos_enu_m[:, None, :], state.uav_vel_enu_mps[:, None, :]
    allowed: BoolArray
    if math.isinf(scenario.max_accel_mps2) and not scenario.blocking_obstacles:  # straight ways in a rectangle
        allowed = np.array(inside_area(pos_m + scenario.slot_s * vel_command_mps[None], scenario))
        allowed &= allowed[:, :1]  # hovering ends where the way begins
    else:
        allowed = np.array(legal_moves(pos_m, vel_mps, vel_command_mps[None], scenario, vel_end_mps[None]))
        accel = scenario.max_accel_mps2
        turn_s = change_time_s(vel_command_mps, vel_end_mps, accel)  # a turn that is not complete ends elsewhere
        allowed &= (turn_s == 0.0) | (change_time_s(vel_mps, vel_command_mps, accel) + turn_s <= scenario.slot_s)
    lost = ~allowed.any(axis=1)
    for uav in np.flatnonzero(lost) if lost.any() else ():
        allowed[uav] = _way_back(scenario, pos_m[uav], vel_mps[uav], vel_command_mps, vel_end_mps)
    return allowed


def _way_back(
    scenario: Scenario, pos_m: FloatArray, vel_mps: FloatArray, vel_command_mps: FloatArray, vel_end_mps: FloatArray
) -> BoolArray:
    start, vel, goal, end = np.broadcast_arrays(pos_m, vel_mps, vel_command_mps, vel_end_mps)
    path_m, _ = slot_path_m(start, vel, goal, scenario.max_accel_mps2, scenario.slot_s, end)
    end_m = path_m[:, -1]
    clear: BoolArray = inside_area(end_m, scenario) & ~hits_obstacle(end_m, scenario, scenario.obstacle_margin_m)
    if clear.any():
        return clear
    nearest = np.argmin(np.sum((end_m - 0.5 * np.asarray(scenario.area.size_m)) ** 2, axis=-1))
    return np.asarray(np.arange(end_m.shape[0]) == nearest)


def _users(
    scenario: Scenario,
    radius_m: float,
    state: WorldState,
    user_pos_enu_m: FloatArray,
    user_blur_m: FloatArray | None,
    settings: SearchSettings,
) -> Users:
    horizon, everybody = user_pos_enu_m.shape[:2]
    present = int(np.count_nonzero(state.user_active))
    who = slice(None) if present == everybody else np.flatnonzero(state.user_active)
    blur = 0.0 if user_blur_m is None else user_blur_m[:horizon, who]
    blur = np.maximum(blur, settings.follow_m)
    goal = scenario.objective
    weight = goal.c_aoi + goal.c_collect * scenario.collect_mbps[who] * scenario.slot_s
    total = float(np.add.reduce(weight))
    ahead: Float32Array = np.zeros((4, horizon, _vectors(present)), np.float32)
    ahead[:2, :, :present] = user_pos_enu_m[:, who].transpose(2, 0, 1)
    ahead[2, :, :present] = radius_m - blur
    ahead[3, :, :present] = 1.0 / np.maximum(2.0 * blur, SHARP_M)
    now: Float32Array = np.zeros((2, _vectors(present)), np.float32)
    now[0, :present] = state.user_aoi_slots[who]
    now[1, :present] = weight / total if total > 0.0 else weight
    return Users(
        present=present,
        east_m=ahead[0],
        north_m=ahead[1],
        aoi_slots=now[0],
        weight=now[1],
        inner_m=ahead[2],
        fade_per_m=ahead[3],
    )


def _prices(scenario: Scenario, settings: SearchSettings, full_speed_j: float, is_last: bool) -> Prices:
    """Rewards of Eq. 8 in slots of mean AoI.

    The freshness part of Eq. 8 telescopes: sum gamma^t c (kappa_t - kappa_t+1) is a constant less
    (1 - gamma) c sum gamma^t kappa_t+1. One served user's bonus c_cover is thus worth
    c_cover / ((1 - gamma) c) slots of AoI, with c the weight of one slot's age and of the data that it brings.
    """
    goal = scenario.objective
    slot_price = (1.0 - goal.gamma) * (goal.c_aoi + goal.c_collect * scenario.mean_slot_mb) or 1.0
    reach_m = scenario.max_speed_mps * scenario.slot_s
    return Prices(
        cover=goal.c_cover / slot_price,
        energy=goal.c_energy / scenario.battery_j / slot_price + settings.thrift / full_speed_j,
        leaf=settings.leaf_weight / reach_m,
        end=0.0 if is_last else settings.leaf_weight / reach_m,
        discount=settings.discount,
        last=settings.last_weight if is_last else 0.0,
    )


def _vectors(users: int) -> int:
    return -(-users // VECTOR) * VECTOR
