"""The compiled motion of N vehicles. One loop over vehicles inside one loop over ticks, no allocation.

Structure of the response (as AC_PosControl does it, which a PX4 resembles closely enough):
1. the commanded velocity is shaped into a desired one, within an acceleration and a jerk limit;
2. the lag behind the shaped path and the velocity error ask for an acceleration, up to the lean limit;
3. the attitude follows as a second-order system; thrust minus drag moves the vehicle through the wind.
"""

from __future__ import annotations

from math import sqrt, tan

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sitl_mock.physics.vehicle import GRAVITY_MPS2

Array = NDArray[np.float64]

# State columns [N, STATE_WIDTH], NED metres from the pad, SI units.
POS, VEL, VEL_WISH, ACCEL_WISH, LAG, INTEGRAL, LEAN, LEAN_RATE = 0, 3, 6, 9, 12, 15, 17, 19
YAW, LIFT, USED_J, POWER_W = 21, 22, 23, 24
STATE_WIDTH = 25
# Command columns [N, COMMAND_WIDTH]: velocity NED (m/s), yaw (rad, NaN holds), motors (0 off, 1 on).
CMD_VEL, CMD_YAW, CMD_MOTORS = 0, 3, 4
COMMAND_WIDTH = 5
# Parameter columns: the order of VehicleType's fields.
(SPEED, ACCEL, JERK, MAX_LEAN, DRAG_1, DRAG_2, GAIN_P, GAIN_I, GAIN_POS, LEAN_FREQ, LEAN_DAMP) = range(11)
(UP, DOWN, ACCEL_Z, JERK_Z, GAIN_Z, YAW_RATE, BATTERY_MAH, BATTERY_V) = range(11, 19)
MAX_LAG_M = 8.0  # the lag that the position loop may build up while thrust is saturated
TWO_PI = 2.0 * np.pi


@njit(cache=True, inline="always")
def _root_gain(error: float, gain: float, limit: float) -> float:
    """Size of the correction: proportional near the goal, a root farther off (AC_Math sqrt_controller)."""
    linear = limit / (gain * gain)
    return error * gain if error <= linear else sqrt(2.0 * limit * (error - 0.5 * linear))


@njit(cache=True)
def _shape_horizontal(row: Array, vn: float, ve: float, kind: Array, dt: float) -> None:
    """Moves the desired velocity straight towards (vn, ve), as the logged turns do."""
    accel, jerk = kind[ACCEL], kind[JERK]
    wn, we = row[VEL_WISH], row[VEL_WISH + 1]
    en, ee = vn - wn, ve - we
    error = sqrt(en * en + ee * ee)
    an, ae = 0.0, 0.0
    if error > 1e-12:
        size = min(_root_gain(error, jerk / accel, jerk), error / dt, accel)
        an, ae = en / error * size, ee / error * size
    dn, de = an - row[ACCEL_WISH], ae - row[ACCEL_WISH + 1]
    change = sqrt(dn * dn + de * de)
    if change > jerk * dt:
        dn, de = dn / change * jerk * dt, de / change * jerk * dt
    row[ACCEL_WISH] += dn
    row[ACCEL_WISH + 1] += de
    row[VEL_WISH] += row[ACCEL_WISH] * dt
    row[VEL_WISH + 1] += row[ACCEL_WISH + 1] * dt


@njit(cache=True)
def _shape_vertical(row: Array, vd: float, accel: float, jerk: float, dt: float) -> None:
    """The same along the vertical axis."""
    error = vd - row[VEL_WISH + 2]
    size = min(_root_gain(abs(error), jerk / accel, jerk), abs(error) / dt, accel)
    change = (size if error > 0.0 else -size) - row[ACCEL_WISH + 2]
    row[ACCEL_WISH + 2] += min(max(change, -jerk * dt), jerk * dt)
    row[VEL_WISH + 2] += row[ACCEL_WISH + 2] * dt


@njit(cache=True)
def _lean(row: Array, kind: Array, dt: float) -> None:
    """Asks for a lean that closes the velocity error, and lets the attitude follow it."""
    gain, integral = kind[GAIN_P], kind[GAIN_I]
    ln, le = row[LAG], row[LAG + 1]
    en = row[VEL_WISH] + kind[GAIN_POS] * ln - row[VEL]
    ee = row[VEL_WISH + 1] + kind[GAIN_POS] * le - row[VEL + 1]
    an = row[ACCEL_WISH] + gain * en + row[INTEGRAL]
    ae = row[ACCEL_WISH + 1] + gain * ee + row[INTEGRAL + 1]
    limit = GRAVITY_MPS2 * tan(kind[MAX_LEAN])
    size = sqrt(an * an + ae * ae)
    gn, ge = row[VEL_WISH] - row[VEL], row[VEL_WISH + 1] - row[VEL + 1]
    if size > limit:
        an, ae = an / size * limit, ae / size * limit
    # With thrust saturated neither integral nor lag may wind up along it (AC_PosControl _limit_vector).
    if size <= limit or an * en + ae * ee < 0.0:
        row[INTEGRAL] += integral * en * dt
        row[INTEGRAL + 1] += integral * ee * dt
    if size <= limit or an * gn + ae * ge < 0.0:
        row[LAG] += gn * dt
        row[LAG + 1] += ge * dt
    lag = sqrt(row[LAG] * row[LAG] + row[LAG + 1] * row[LAG + 1])
    if lag > MAX_LAG_M:
        row[LAG] *= MAX_LAG_M / lag
        row[LAG + 1] *= MAX_LAG_M / lag
    freq, damp = kind[LEAN_FREQ], kind[LEAN_DAMP]
    row[LEAN_RATE] += (freq * freq * (an - row[LEAN]) - 2.0 * damp * freq * row[LEAN_RATE]) * dt
    row[LEAN_RATE + 1] += (freq * freq * (ae - row[LEAN + 1]) - 2.0 * damp * freq * row[LEAN_RATE + 1]) * dt
    row[LEAN] += row[LEAN_RATE] * dt
    row[LEAN + 1] += row[LEAN_RATE + 1] * dt


@njit(cache=True)
def _fly(row: Array, cmd: Array, kind: Array, wind: Array, dt: float) -> None:
    """One tick with motors running."""
    vn, ve = cmd[CMD_VEL], cmd[CMD_VEL + 1]
    speed = sqrt(vn * vn + ve * ve)
    if speed > kind[SPEED]:
        vn, ve = vn / speed * kind[SPEED], ve / speed * kind[SPEED]
    vd = min(max(cmd[CMD_VEL + 2], -kind[UP]), kind[DOWN])
    _shape_vertical(row, vd, kind[ACCEL_Z], kind[JERK_Z], dt)
    if row[POS + 2] >= 0.0 and row[VEL_WISH + 2] >= 0.0:  # standing on the ground, not told to climb
        _rest(row)
        return
    _shape_horizontal(row, vn, ve, kind, dt)
    _lean(row, kind, dt)
    an, ae = row[VEL] - wind[0], row[VEL + 1] - wind[1]
    drag = kind[DRAG_1] + kind[DRAG_2] * sqrt(an * an + ae * ae)
    row[VEL] += (row[LEAN] - drag * an) * dt
    row[VEL + 1] += (row[LEAN + 1] - drag * ae) * dt
    climb_error = row[VEL_WISH + 2] - row[VEL + 2]
    row[LIFT] = row[ACCEL_WISH + 2] + kind[GAIN_Z] * climb_error
    row[VEL + 2] += row[LIFT] * dt


@njit(cache=True)
def _rest(row: Array) -> None:
    """Stands on the ground: nothing moves and no controller remembers a past."""
    row[POS + 2] = min(row[POS + 2], 0.0) if row[POS + 2] < -1e-9 else 0.0
    for column in range(VEL, LEAN_RATE + 2):
        row[column] = 0.0
    row[LIFT] = 0.0


@njit(cache=True)
def _fall(row: Array, kind: Array, wind: Array, dt: float) -> None:
    """One tick with motors off: on the ground it rests, in the air it falls."""
    if row[POS + 2] >= 0.0:
        _rest(row)
        return
    for axis in range(3):
        air = row[VEL + axis] - (wind[axis] if axis < 2 else 0.0)
        row[VEL + axis] -= (kind[DRAG_1] + kind[DRAG_2] * abs(air)) * air * dt
    row[VEL + 2] += GRAVITY_MPS2 * dt


@njit(cache=True)
def _turn(row: Array, yaw_rad: float, rate_radps: float, dt: float) -> None:
    """Turns the nose towards `yaw_rad` the short way."""
    if np.isnan(yaw_rad):
        return
    error = (yaw_rad - row[YAW] + np.pi) % TWO_PI - np.pi
    row[YAW] = (row[YAW] + min(max(error, -rate_radps * dt), rate_radps * dt)) % TWO_PI


@njit(cache=True)
def _power_w(row: Array, wind: Array, table_w: Array, table_step_mps: float) -> float:
    """Propulsion power at the present airspeed, from the world's energy model tabulated finely."""
    an, ae = row[VEL] - wind[0], row[VEL + 1] - wind[1]
    place = sqrt(an * an + ae * ae) / table_step_mps
    low = min(int(place), table_w.shape[0] - 2)
    return float(table_w[low] + (place - low) * (table_w[low + 1] - table_w[low]))


@njit(cache=True)
def advance(
    state: Array,
    command: Array,
    kinds: Array,
    wind: Array,
    table_w: Array,
    table_step_mps: float,
    dt: float,
    ticks: int,
) -> None:
    """Moves every vehicle on by `ticks` steps of `dt` seconds under constant commands.

    state [N, STATE_WIDTH] (changed in place), command [N, COMMAND_WIDTH], kinds [N, P], wind [N, 2] m/s NE.
    """
    for i in range(state.shape[0]):
        row, cmd, kind = state[i], command[i], kinds[i]
        for _ in range(ticks):
            if cmd[CMD_MOTORS] > 0.0:
                _fly(row, cmd, kind, wind[i], dt)
                _turn(row, cmd[CMD_YAW], kind[YAW_RATE], dt)
                row[POWER_W] = _power_w(row, wind[i], table_w, table_step_mps)
                row[USED_J] += row[POWER_W] * dt
            else:
                _fall(row, kind, wind[i], dt)
                row[POWER_W] = 0.0
            for axis in range(3):
                row[POS + axis] += row[VEL + axis] * dt
            if row[POS + 2] > 0.0:  # the ground stops what reaches it
                row[POS + 2] = 0.0
                _rest(row)
