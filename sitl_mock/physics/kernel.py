"""The compiled motion of N vehicles. Loops over vehicles without branches, so that one instruction moves several.

Structure of the response (as AC_PosControl does it, which a PX4 resembles closely enough):
1. the commanded velocity is shaped into a desired one, within an acceleration and a jerk limit;
2. the lag behind the shaped path and the velocity error ask for an acceleration, up to the lean limit;
3. the attitude follows as a second-order system; thrust minus drag moves the vehicle through the wind.

The controls decide once a step (0.1 s); the attitude's response in it is exact, and the acceleration that
follows holds for the step, so that positions between two steps are exact too.

numba keeps the compiled code beside this file and looks at this file's age alone: whoever changes the layout, the
gusts or a constant that is compiled in must touch this file too.
"""

# ruff: noqa: SIM110 - numba takes arrays and loops, not objects and generators
from __future__ import annotations

from math import floor, pi, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sitl_mock.physics import layout
from sitl_mock.physics.gusts import gust
from sitl_mock.physics.vehicle import GRAVITY_MPS2, PARAMETERS

Array = NDArray[np.float64]

B = layout.BLOCK
STATE_ROWS, BUFFER_ROWS = layout.STATE_ROWS, layout.BUFFER_ROWS
# Offsets of the rows in the flat buffer: constants, so that the compiler sees that rows never overlap.
_POS_N, _POS_E, _POS_D = (B * (layout.POS + i) for i in range(3))
_VEL_N, _VEL_E, _VEL_D = (B * (layout.VEL + i) for i in range(3))
_WISH_N, _WISH_E, _WISH_D = (B * (layout.VEL_WISH + i) for i in range(3))
_WISHED_ACC_N, _WISHED_ACC_E, _WISHED_ACC_D = (B * (layout.ACCEL_WISH + i) for i in range(3))
_LAG_N, _LAG_E = B * layout.LAG, B * (layout.LAG + 1)
_SUM_N, _SUM_E = B * layout.INTEGRAL, B * (layout.INTEGRAL + 1)
_LEAN_N, _LEAN_E = B * layout.LEAN, B * (layout.LEAN + 1)
_RATE_N, _RATE_E = B * layout.LEAN_RATE, B * (layout.LEAN_RATE + 1)
_WAS_N, _WAS_E = B * layout.LEAN_WAS, B * (layout.LEAN_WAS + 1)
_ACC_N, _ACC_E, _ACC_D = (B * (layout.ACCEL + i) for i in range(3))
_YAW, _USED_J, _POWER_W = B * layout.YAW, B * layout.USED_J, B * layout.POWER_W
_CMD_N, _CMD_E, _CMD_D, _CMD_YAW, _CMD_MOTORS = (B * (layout.COMMAND + i) for i in range(5))
(_SPEED, _ACCEL, _JERK, _THRUST, _DRAG_1, _DRAG_2, _GAIN_P, _GAIN_I, _GAIN_POS, _PHI_11, _PHI_12, _PHI_21, _PHI_22,
 _UP, _DOWN, _ACCEL_Z, _JERK_Z, _GAIN_Z, _YAW_RATE, _SHAPE, _LINEAR, _SHAPE_Z, _LINEAR_Z) = (
    B * (layout.LIMITS + i) for i in range(len(PARAMETERS)))  # fmt: skip
_STEADY_N, _STEADY_E = B * layout.STEADY_WIND, B * (layout.STEADY_WIND + 1)
_WIND_N, _WIND_E, _WIND_D = (B * (layout.WIND + i) for i in range(3))
_AIRSPEED = B * layout.AIRSPEED
_FIRST_MOTION, _LAST_MOTION = layout.VEL, layout.ACCEL + 3  # rows that are zero at rest

MAX_LAG_M = 8.0  # the lag that the position loop may build up while thrust is saturated
_MARGIN_M = 1.0  # more than a step's acceleration adds to a step's way
_TINY = 1e-24  # keeps a division by a vanishing length finite
TWO_PI = 2.0 * pi


@njit(cache=True, inline="always")
def _root_gain(error: float, gain: float, linear: float, limit: float) -> float:
    """Size of the correction: proportional up to `linear`, a root farther off (AC_Math sqrt_controller)."""
    root = sqrt(2.0 * limit * max(error - 0.5 * linear, 0.0))
    return error * gain if error <= linear else root


@njit(cache=True, error_model="numpy")
def _limit_commands(b: Array, count: int) -> None:
    """What is asked for beyond the vehicle's speeds is cut, horizontally without a turn."""
    for j in range(count):
        vn, ve, top = b[_CMD_N + j], b[_CMD_E + j], b[_SPEED + j]
        slow = top / sqrt(max(vn * vn + ve * ve, top * top + _TINY))
        b[_CMD_N + j], b[_CMD_E + j] = vn * slow, ve * slow
        b[_CMD_D + j] = min(max(b[_CMD_D + j], -b[_UP + j]), b[_DOWN + j])


@njit(cache=True, error_model="numpy")
def _shape_horizontal(b: Array, count: int, dt: float) -> None:
    """Moves the wished acceleration so that the desired velocity goes straight to the commanded one."""
    rate = 1.0 / dt
    for j in range(count):
        en, ee = b[_CMD_N + j] - b[_WISH_N + j], b[_CMD_E + j] - b[_WISH_E + j]
        error = sqrt(en * en + ee * ee + _TINY)
        wanted = _root_gain(error, b[_SHAPE + j], b[_LINEAR + j], b[_JERK + j])
        size = min(wanted, error * rate, b[_ACCEL + j]) / error
        dn, de = en * size - b[_WISHED_ACC_N + j], ee * size - b[_WISHED_ACC_E + j]
        most = b[_JERK + j] * dt
        part = most / sqrt(max(dn * dn + de * de, most * most))
        b[_WISHED_ACC_N + j] += dn * part
        b[_WISHED_ACC_E + j] += de * part


@njit(cache=True, error_model="numpy")
def _shape_vertical(b: Array, count: int, dt: float) -> None:
    """The same along the vertical axis, and the climb that follows."""
    rate = 1.0 / dt
    for j in range(count):
        error = b[_CMD_D + j] - b[_WISH_D + j]
        off, most = abs(error), b[_JERK_Z + j] * dt
        size = min(_root_gain(off, b[_SHAPE_Z + j], b[_LINEAR_Z + j], b[_JERK_Z + j]), off * rate, b[_ACCEL_Z + j])
        change = (size if error > 0.0 else -size) - b[_WISHED_ACC_D + j]
        wished = b[_WISHED_ACC_D + j] + min(max(change, -most), most)
        b[_WISHED_ACC_D + j] = wished
        b[_ACC_D + j] = wished + b[_GAIN_Z + j] * (b[_WISH_D + j] - b[_VEL_D + j])
        b[_WISH_D + j] += wished * dt


@njit(cache=True, error_model="numpy")
def _lean(b: Array, count: int, dt: float) -> None:
    """Asks for a lean that closes the velocity error, and lets the attitude follow it."""
    for j in range(count):
        gn, ge = b[_WISH_N + j] - b[_VEL_N + j], b[_WISH_E + j] - b[_VEL_E + j]
        en, ee = gn + b[_GAIN_POS + j] * b[_LAG_N + j], ge + b[_GAIN_POS + j] * b[_LAG_E + j]
        an = b[_WISHED_ACC_N + j] + b[_GAIN_P + j] * en + b[_SUM_N + j]
        ae = b[_WISHED_ACC_E + j] + b[_GAIN_P + j] * ee + b[_SUM_E + j]
        most = b[_THRUST + j] * b[_CMD_MOTORS + j]
        square = an * an + ae * ae
        part = most / sqrt(max(square, most * most))
        an, ae = an * part, ae * part
        # With thrust saturated neither integral nor lag may wind up along it (AC_PosControl _limit_vector).
        free = square <= most * most
        sums = b[_GAIN_I + j] * dt if free or an * en + ae * ee < 0.0 else 0.0
        b[_SUM_N + j] += sums * en
        b[_SUM_E + j] += sums * ee
        lags = dt if free or an * gn + ae * ge < 0.0 else 0.0
        ln, le = b[_LAG_N + j] + lags * gn, b[_LAG_E + j] + lags * ge
        near = MAX_LAG_M / sqrt(max(ln * ln + le * le, MAX_LAG_M * MAX_LAG_M))
        b[_LAG_N + j], b[_LAG_E + j] = ln * near, le * near
        b[_WISH_N + j] += b[_WISHED_ACC_N + j] * dt
        b[_WISH_E + j] += b[_WISHED_ACC_E + j] * dt
        xn, xe = b[_LEAN_N + j] - an, b[_LEAN_E + j] - ae
        rn, re = b[_RATE_N + j], b[_RATE_E + j]
        b[_WAS_N + j], b[_WAS_E + j] = b[_LEAN_N + j], b[_LEAN_E + j]
        b[_LEAN_N + j] = an + b[_PHI_11 + j] * xn + b[_PHI_12 + j] * rn
        b[_LEAN_E + j] = ae + b[_PHI_11 + j] * xe + b[_PHI_12 + j] * re
        b[_RATE_N + j] = b[_PHI_21 + j] * xn + b[_PHI_22 + j] * rn
        b[_RATE_E + j] = b[_PHI_21 + j] * xe + b[_PHI_22 + j] * re


@njit(cache=True, error_model="numpy")
def _accelerate(b: Array, count: int) -> None:
    """Thrust (the mean lean of the step) less drag in the moving air."""
    for j in range(count):
        an, ae = b[_VEL_N + j] - b[_WIND_N + j], b[_VEL_E + j] - b[_WIND_E + j]
        airspeed = sqrt(an * an + ae * ae)
        drag = b[_DRAG_1 + j] + b[_DRAG_2 + j] * airspeed
        b[_AIRSPEED + j] = airspeed
        b[_ACC_N + j] = 0.5 * (b[_WAS_N + j] + b[_LEAN_N + j]) - drag * an
        b[_ACC_E + j] = 0.5 * (b[_WAS_E + j] + b[_LEAN_E + j]) - drag * ae
        b[_ACC_D + j] += drag * b[_WIND_D + j]


@njit(cache=True, error_model="numpy")
def _power(b: Array, count: int, table_w: Array, table_step_mps: float) -> None:
    """Propulsion power at the present airspeed, from the world's energy model tabulated finely."""
    places_a_mps = 1.0 / table_step_mps
    for j in range(count):
        place = b[_AIRSPEED + j] * places_a_mps
        low = min(int(place), table_w.shape[0] - 2)
        b[_POWER_W + j] = table_w[low] + (place - low) * (table_w[low + 1] - table_w[low])


@njit(cache=True, error_model="numpy")
def _rest(b: Array, j: int) -> None:
    """Stands on the ground: nothing moves and no controller remembers a past."""
    b[_POS_D + j] = 0.0
    for row in range(_FIRST_MOTION, _LAST_MOTION):
        b[row * B + j] = 0.0


@njit(cache=True, error_model="numpy")
def _fall(b: Array, j: int) -> None:
    """Motors off in the air."""
    an, ae, ad = b[_VEL_N + j] - b[_WIND_N + j], b[_VEL_E + j] - b[_WIND_E + j], b[_VEL_D + j]
    b[_ACC_N + j] = -(b[_DRAG_1 + j] + b[_DRAG_2 + j] * abs(an)) * an
    b[_ACC_E + j] = -(b[_DRAG_1 + j] + b[_DRAG_2 + j] * abs(ae)) * ae
    b[_ACC_D + j] = GRAVITY_MPS2 - (b[_DRAG_1 + j] + b[_DRAG_2 + j] * abs(ad)) * ad


@njit(cache=True, error_model="numpy")
def _turn(b: Array, j: int, dt: float) -> None:
    """Turns the nose towards the commanded yaw the short way."""
    if np.isnan(b[_CMD_YAW + j]):
        return
    error = b[_CMD_YAW + j] - b[_YAW + j]
    error -= TWO_PI * floor((error + pi) / TWO_PI)
    most = b[_YAW_RATE + j] * dt
    yaw = b[_YAW + j] + min(max(error, -most), most)
    b[_YAW + j] = yaw - TWO_PI * floor(yaw / TWO_PI)


@njit(cache=True, error_model="numpy")
def _fly(b: Array, count: int, dt: float, table_w: Array, table_step_mps: float, turning: bool) -> None:
    """One step's controls of vehicles whose motors carry them."""
    _shape_vertical(b, count, dt)
    _shape_horizontal(b, count, dt)
    _lean(b, count, dt)
    _accelerate(b, count)
    _power(b, count, table_w, table_step_mps)
    if turning:
        for j in range(count):
            _turn(b, j, dt)


@njit(cache=True, error_model="numpy")
def _control_each(b: Array, count: int, dt: float, table_w: Array, table_step_mps: float, turning: bool) -> None:
    """Decides the acceleration of the step that begins, vehicle by vehicle: some stand or fall."""
    for j in range(count):
        motors, grounded = b[_CMD_MOTORS + j], b[_POS_D + j] >= 0.0
        standing = grounded and (motors <= 0.0 or b[_CMD_D + j] >= 0.0)
        if motors > 0.0 and not standing:
            _fly(b[j:], 1, dt, table_w, table_step_mps, turning)
            continue
        if standing:
            _rest(b, j)
        else:
            _fall(b, j)
        b[_AIRSPEED + j], b[_POWER_W + j] = 0.0, 0.0
        if motors > 0.0:  # spinning on the ground costs what hovering costs
            _power(b[j:], 1, table_w, table_step_mps)


@njit(cache=True, error_model="numpy")
def _drift(b: Array, count: int, dt: float) -> None:
    """Moves on by `dt` under the step's accelerations."""
    half = 0.5 * dt * dt
    for j in range(count):
        b[_POS_N + j] += b[_VEL_N + j] * dt + b[_ACC_N + j] * half
        b[_VEL_N + j] += b[_ACC_N + j] * dt
        b[_POS_E + j] += b[_VEL_E + j] * dt + b[_ACC_E + j] * half
        b[_VEL_E + j] += b[_ACC_E + j] * dt
        b[_POS_D + j] += b[_VEL_D + j] * dt + b[_ACC_D + j] * half
        b[_VEL_D + j] += b[_ACC_D + j] * dt
        b[_USED_J + j] += b[_POWER_W + j] * dt


@njit(cache=True, error_model="numpy")
def _land(b: Array, count: int) -> None:
    """The ground stops what reaches it."""
    for j in range(count):
        if b[_POS_D + j] > 0.0:
            _rest(b, j)


@njit(cache=True, error_model="numpy")
def _near_ground(b: Array, count: int, ahead_s: float) -> int:
    """How many could touch the ground within so many seconds."""
    near = 0
    for j in range(count):
        near += 1 if b[_POS_D + j] + max(b[_VEL_D + j], 0.0) * ahead_s > -_MARGIN_M else 0
    return near


@njit(cache=True, error_model="numpy")
def _powered(b: Array, count: int) -> bool:
    """Whether all motors turn."""
    for j in range(count):
        if b[_CMD_MOTORS + j] <= 0.0:
            return False
    return True


@njit(cache=True, error_model="numpy")
def _turning(b: Array, count: int) -> bool:
    """Whether any vehicle is told where to look."""
    for j in range(count):
        if not np.isnan(b[_CMD_YAW + j]):
            return True
    return False


@njit(cache=True, error_model="numpy")
def _load(b: Array, rows: Array, first_row: int, first: int, count: int) -> None:
    for row in range(rows.shape[0]):
        for j in range(count):
            b[(first_row + row) * B + j] = rows[row, first + j]


@njit(cache=True, error_model="numpy")
def _store(b: Array, rows: Array, first: int, count: int) -> None:
    for row in range(rows.shape[0]):
        for j in range(count):
            rows[row, first + j] = b[row * B + j]


@njit(cache=True, error_model="numpy")
def _calm(b: Array, count: int) -> None:
    """The steady wind alone."""
    for j in range(count):
        b[_WIND_N + j], b[_WIND_E + j], b[_WIND_D + j] = b[_STEADY_N + j], b[_STEADY_E + j], 0.0


@njit(cache=True, error_model="numpy")
def _blow(b: Array, count: int, first: int, step: int, dt: float, gust_w20_mps: float, seed: int) -> None:
    """The air of this step: the steady wind and a gust for each."""
    _calm(b, count)
    for j in range(count):
        gust(b, j, seed, first + j, step, dt, gust_w20_mps)


@njit(cache=True, error_model="numpy")
def _run(
    b: Array,
    count: int,
    first: int,
    table_w: Array,
    table_step_mps: float,
    tick_s: float,
    step_ticks: int,
    done: int,
    end: int,
    gust_w20_mps: float,
    seed: int,
) -> None:
    """Moves a loaded block from tick `done` to tick `end`."""
    step_s = step_ticks * tick_s
    powered, turning = _powered(b, count), _turning(b, count)
    _limit_commands(b, count)
    _calm(b, count)
    while done < end:
        near = _near_ground(b, count, step_s) > 0
        if done % step_ticks == 0:
            if gust_w20_mps > 0.0:
                _blow(b, count, first, done // step_ticks, step_s, gust_w20_mps, seed)
            if powered and not near:
                _fly(b, count, step_s, table_w, table_step_mps, turning)
            else:
                _control_each(b, count, step_s, table_w, table_step_mps, turning)
        # Near the ground every tick looks where it is, however many are asked for.
        stride = 1 if near else min(step_ticks - done % step_ticks, end - done)
        _drift(b, count, stride * tick_s)
        if near:
            _land(b, count)
        done += stride


@njit(cache=True, error_model="numpy")
def advance(
    state: Array,
    command: Array,
    limits: Array,
    wind: Array,
    table_w: Array,
    table_step_mps: float,
    tick_s: float,
    step_ticks: int,
    ticks_done: int,
    ticks: int,
    gust_w20_mps: float,
    seed: int,
) -> None:
    """Moves every vehicle on by `ticks` ticks of `tick_s` seconds under constant commands.

    state [STATE_ROWS, N] (changed in place), command [COMMAND_ROWS, N], limits [P, N], wind [2, N] m/s NE.
    The controls decide whenever `ticks_done` and what was added to it is a multiple of `step_ticks`.
    """
    b = np.zeros(BUFFER_ROWS * B)
    end = ticks_done + ticks
    for first in range(0, state.shape[1], B):
        count = min(B, state.shape[1] - first)
        _load(b, state, 0, first, count)
        _load(b, command, layout.COMMAND, first, count)
        _load(b, limits, layout.LIMITS, first, count)
        _load(b, wind, layout.STEADY_WIND, first, count)
        _run(b, count, first, table_w, table_step_mps, tick_s, step_ticks, ticks_done, end, gust_w20_mps, seed)
        _store(b, state, first, count)
