"""What a vehicle can do: limits that a data sheet or a flight controller's parameters name.

The motion model reads nothing else, so a new airframe is a new `VehicleType`, never a new curve.
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass
from math import radians, tan

import numpy as np
from numpy.typing import NDArray

GRAVITY_MPS2 = 9.80665  # standard gravity, CGPM 1901
Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class VehicleType:
    """Limits and response of one airframe with its flight controller."""

    max_speed_mps: float  # horizontal, what the flight controller lets through
    max_accel_mps2: float  # horizontal, the shaping limit (ArduPilot WPNAV_ACCEL)
    max_jerk_mps3: float  # horizontal, the shaping limit (ArduPilot PSC_JERK_XY)
    max_lean_rad: float  # ArduPilot ANGLE_MAX, PX4 MPC_TILTMAX_AIR
    drag_linear_1ps: float  # deceleration per m/s of airspeed: rotor (momentum) drag
    drag_quadratic_1pm: float  # deceleration per (m/s)^2 of airspeed: body drag
    velocity_gain_1ps: float  # velocity error to acceleration (ArduPilot PSC_VELXY_P)
    velocity_integral_1ps2: float  # integral of the same (ArduPilot PSC_VELXY_I)
    position_gain_1ps: float  # lag behind the shaped path to velocity (ArduPilot PSC_POSXY_P)
    lean_frequency_radps: float  # natural frequency of the attitude's second-order response
    lean_damping: float
    climb_mps: float
    descent_mps: float
    max_accel_z_mps2: float  # ArduPilot WPNAV_ACCEL_Z
    max_jerk_z_mps3: float  # ArduPilot PSC_JERK_Z
    vertical_gain_1ps: float  # vertical velocity error to acceleration
    yaw_rate_radps: float
    battery_mah: float
    battery_v: float

    @property
    def battery_j(self) -> float:
        """Energy of the full battery: charge times nominal voltage."""
        return self.battery_mah * 3.6 * self.battery_v

    @property
    def max_thrust_accel_mps2(self) -> float:
        """Horizontal acceleration at full lean while holding height: g tan(lean)."""
        return GRAVITY_MPS2 * tan(self.max_lean_rad)


# DJI Matrice 600 as in the paper (Section VII): 18 m/s, 25 deg lean (DJI specifications), 5 m/s up, 3 m/s
# down, 4500 mAh at 22.2 V (TB47S; the paper counts one). DJI publishes no drag: 1 m/s^2 at 18 m/s is assumed,
# which leaves most of g tan(25 deg) = 4.57 m/s^2 for acceleration. Response gains: those of the fitted logs.
M600 = VehicleType(
    max_speed_mps=18.0,
    max_accel_mps2=4.5,
    max_jerk_mps3=10.0,
    max_lean_rad=radians(25.0),
    drag_linear_1ps=0.0,
    drag_quadratic_1pm=1.0 / 18.0**2,
    velocity_gain_1ps=2.0,
    velocity_integral_1ps2=1.0,
    position_gain_1ps=1.0,
    lean_frequency_radps=16.7,
    lean_damping=1.34,
    climb_mps=5.0,
    descent_mps=3.0,
    max_accel_z_mps2=2.5,
    max_jerk_z_mps3=5.0,
    vertical_gain_1ps=2.2,
    yaw_rate_radps=radians(90.0),
    battery_mah=4500.0,
    battery_v=22.2,
)

# The 3 kg quad of the flight logs under ArduCopter 4.5.6 with its default parameters: WPNAV_ACCEL 250 cm/s^2,
# PSC_JERK_XY 5, PSC_VELXY_P 2 and _I 1, PSC_POSXY_P 1, ANGLE_MAX 3000, WPNAV_SPEED_UP 250 and _DN 150,
# WPNAV_ACCEL_Z 100, PSC_JERK_Z 5 (AC_PosControl, AC_WPNav). Drag follows from the lean that the log holds at
# steady 5, 10, 15 and 18 m/s (7.45, 16.0, 25.0, 30.1 deg). Fitted: the attitude's response, a lag of
# 2 * 1.34 / 16.7 = 0.16 s (ATC_INPUT_TC is 0.15 s), and the vertical gain. See docs/mock.md.
ARDUQUAD = VehicleType(
    max_speed_mps=30.0,
    max_accel_mps2=2.5,
    max_jerk_mps3=5.0,
    max_lean_rad=radians(30.0),
    drag_linear_1ps=0.234,
    drag_quadratic_1pm=0.00456,
    velocity_gain_1ps=2.0,
    velocity_integral_1ps2=1.0,
    position_gain_1ps=1.0,
    lean_frequency_radps=16.7,
    lean_damping=1.34,
    climb_mps=2.5,
    descent_mps=1.5,
    max_accel_z_mps2=1.0,
    max_jerk_z_mps3=5.0,
    vertical_gain_1ps=2.2,
    yaw_rate_radps=radians(90.0),
    battery_mah=10_000.0,
    battery_v=12.6,
)


PARAMETERS = (
    "speed", "accel", "jerk", "thrust", "drag_1", "drag_2", "gain_p", "gain_i", "gain_pos",
    "phi_11", "phi_12", "phi_21", "phi_22",
    "up", "down", "accel_z", "jerk_z", "gain_z", "yaw_rate", "shape", "linear", "shape_z", "linear_z",
)  # fmt: skip


def lean_transition(frequency_radps: float, damping: float, step_s: float) -> tuple[float, float, float, float]:
    """The exact step of a second-order response: [error, rate] after `step_s` from those before, row by row."""
    root = cmath.sqrt(complex(damping**2 - 1.0 + 1e-12))  # never quite critical, where the two poles are one
    fast, slow = -frequency_radps * (damping + root), -frequency_radps * (damping - root)
    grown_fast, grown_slow = cmath.exp(fast * step_s), cmath.exp(slow * step_s)
    apart = slow - fast
    return (
        ((slow * grown_fast - fast * grown_slow) / apart).real,
        ((grown_slow - grown_fast) / apart).real,
        (fast * slow * (grown_fast - grown_slow) / apart).real,
        ((slow * grown_slow - fast * grown_fast) / apart).real,
    )


def parameter_column(kind: VehicleType, step_s: float) -> Array:
    """[P] what the kernel reads of a type, in the order of PARAMETERS."""
    return np.array([
        kind.max_speed_mps,
        kind.max_accel_mps2,
        kind.max_jerk_mps3,
        kind.max_thrust_accel_mps2,
        kind.drag_linear_1ps,
        kind.drag_quadratic_1pm,
        kind.velocity_gain_1ps,
        kind.velocity_integral_1ps2,
        kind.position_gain_1ps,
        *lean_transition(kind.lean_frequency_radps, kind.lean_damping, step_s),
        kind.climb_mps,
        kind.descent_mps,
        kind.max_accel_z_mps2,
        kind.max_jerk_z_mps3,
        kind.vertical_gain_1ps,
        kind.yaw_rate_radps,
        kind.max_jerk_mps3 / kind.max_accel_mps2,  # gain of the velocity shaping, and up to which error it holds
        kind.max_accel_mps2**2 / kind.max_jerk_mps3,
        kind.max_jerk_z_mps3 / kind.max_accel_z_mps2,
        kind.max_accel_z_mps2**2 / kind.max_jerk_z_mps3,
    ])  # fmt: skip
