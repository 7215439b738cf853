"""The numbers that the compiled rules hold a fleet to. numba knows a tuple's fields by its type, never by this file."""

from typing import NamedTuple


class Bounds(NamedTuple):
    """The numbers of an envelope as the compiled rules read them; names and units as in ``Envelope``."""

    width_m: float
    height_m: float
    fence_margin_m: float
    obstacle_margin_m: float
    min_alt_m: float
    max_alt_m: float
    max_speed_mps: float
    max_climb_mps: float
    max_descent_mps: float
    accel_mps2: float
    brake_mps2: float
    vertical_accel_mps2: float
    reaction_s: float
    tick_s: float
    timeout_s: float
    separation_m: float
    vertical_separation_m: float
