"""Gusts: the Dryden model at low altitude (MIL-F-8785C, 3.7.3), one independent stream of chance a vehicle.

Chance is a function of seed, vehicle and step, not of a shared generator: the same vehicle meets the same gusts
whether it flies alone or among thousands, in one call or in many.
"""

from __future__ import annotations

from math import cos, exp, log, pi, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sitl_mock.physics import layout

Array = NDArray[np.float64]

_B = layout.BLOCK
_POS_D, _VEL_N, _VEL_E = _B * (layout.POS + 2), _B * layout.VEL, _B * (layout.VEL + 1)
_STATE = tuple(_B * (layout.GUST + i) for i in range(5))  # along; across (2 states); vertical (2 states)
_STEADY_N, _STEADY_E = _B * layout.STEADY_WIND, _B * (layout.STEADY_WIND + 1)
_WIND_N, _WIND_E, _WIND_D = (_B * (layout.WIND + i) for i in range(3))
_FEET_M = 0.3048
_LOWEST_FT, _HIGHEST_FT = 10.0, 1000.0  # where the low-altitude formulas hold
_SLOWEST_MPS = 1.0  # a hovering vehicle still has the eddies drift past it


@njit(cache=True)
def _mix(value: np.uint64) -> np.uint64:
    """SplitMix64's finaliser (Steele, Lea, Flood 2014)."""
    value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return value ^ (value >> np.uint64(31))


@njit(cache=True)
def uniform(seed: int, vehicle: int, step: int, number: int) -> float:
    """In (0, 1), the same for the same four numbers."""
    key = _mix(np.uint64(seed) + np.uint64(0x9E3779B97F4A7C15) * np.uint64(vehicle + 1))
    key = _mix(key + np.uint64(0x9E3779B97F4A7C15) * np.uint64(8 * step + number + 1))
    return (float(key >> np.uint64(11)) + 0.5) / 9007199254740992.0


@njit(cache=True)
def normal(seed: int, vehicle: int, step: int, number: int) -> float:
    """Standard normal (Box and Muller)."""
    size = sqrt(-2.0 * log(uniform(seed, vehicle, step, 2 * number)))
    return size * cos(2.0 * pi * uniform(seed, vehicle, step, 2 * number + 1))


@njit(cache=True)
def _second_order(
    b: Array, row: int, rate_1ps: float, sigma_mps: float, dt: float, eta_1: float, eta_2: float
) -> float:
    """Across and vertical: sigma sqrt(1/rate) (1 + sqrt(3) s / rate) / (1 + s / rate)^2, stepped exactly.

    x1' = -a x1 + w, x2' = -a x2 + x1 with unit white noise w; the step's noise has the exact covariance.
    """
    a, decay = rate_1ps, exp(-rate_1ps * dt)
    e2, z = decay * decay, rate_1ps * dt
    q11 = (1.0 - e2) / (2.0 * a)
    q12 = (1.0 - e2 * (1.0 + 2.0 * z)) / (4.0 * a * a)
    q22 = (1.0 - e2 * (1.0 + 2.0 * z + 2.0 * z * z)) / (4.0 * a**3)
    root = sqrt(q11)
    x1, x2 = b[row], b[row + _B]
    b[row + _B] = decay * (x2 + dt * x1) + q12 / root * eta_1 + sqrt(max(q22 - q12 * q12 / q11, 0.0)) * eta_2
    b[row] = decay * x1 + root * eta_1
    # H = sigma sqrt(a) (sqrt(3) / a) a^2 (s + a / sqrt(3)) / (s + a)^2 = sigma sqrt(a) (sqrt(3) x1' + ...)
    return sigma_mps * sqrt(a) * float(sqrt(3.0) * b[row] + a * (1.0 - sqrt(3.0)) * b[row + _B])


@njit(cache=True)
def gust(b: Array, j: int, seed: int, vehicle: int, step: int, dt: float, w20_mps: float) -> None:
    """Adds this step's gust to the air around vehicle column `j`; `w20_mps` is the wind at 20 ft."""
    height_ft = min(max(-b[_POS_D + j] / _FEET_M, _LOWEST_FT), _HIGHEST_FT)
    shape = 0.177 + 0.000823 * height_ft
    length_m, length_w_m = height_ft / shape**1.2 * _FEET_M, height_ft * _FEET_M
    sigma_w = 0.1 * w20_mps
    sigma = sigma_w / shape**0.4
    wn, we = b[_STEADY_N + j], b[_STEADY_E + j]
    an, ae = b[_VEL_N + j] - wn, b[_VEL_E + j] - we
    airspeed = max(sqrt(an * an + ae * ae), _SLOWEST_MPS)
    eta = [normal(seed, vehicle, step, number) for number in range(4)]
    decay = exp(-airspeed / length_m * dt)
    # The discrete first-order filter keeps the variance sigma^2 exactly.
    b[_STATE[0] + j] = decay * b[_STATE[0] + j] + sigma * sqrt(1.0 - decay * decay) * eta[0]
    eta_4, eta_5 = normal(seed, vehicle, step, 4), eta[3]
    across = _second_order(b, _STATE[1] + j, airspeed / length_m, sigma, dt, eta[1], eta_4)
    down = _second_order(b, _STATE[3] + j, airspeed / length_w_m, sigma_w, dt, eta[2], eta_5)
    wind = sqrt(wn * wn + we * we)
    north, east = (wn / wind, we / wind) if wind > 1e-9 else (1.0, 0.0)
    b[_WIND_N + j] += b[_STATE[0] + j] * north - across * east
    b[_WIND_E + j] += b[_STATE[0] + j] * east + across * north
    b[_WIND_D + j] += down
