"""Air-to-ground channel: path loss and blockage (Eq. 1, 2), coupling loss and who is served (Def. 1).

Floating-intercept parameters at 28 GHz and the human-blocker model: paper, Section VII-A.
"""

import math
from dataclasses import dataclass

import numpy as np

from policy.world.arrays import Array, array_namespace

MIN_DISTANCE_M = 1.0  # a log-distance law has no meaning nearer than its 1 m reference


@dataclass(frozen=True)
class Radio:
    """Link budget and blockage parameters; defaults are the paper's (Section VII-A)."""

    mcl_db: float = 117.0
    alpha_los_db: float = 84.64
    beta_los: float = 1.55
    alpha_nlos_db: float = 113.63
    beta_nlos: float = 1.16
    g_tx_db: float = 0.0
    g_rx_db: float = 5.0
    user_height_m: float = 1.7
    device_height_m: float = 1.3
    user_width_m: float = 0.5
    blockers_per_m2: float = 0.005


def path_loss_db(distance_3d_m: Array, alpha_db: float, beta: float) -> Array:
    """Eq. 1, alpha + 10 beta log10(d): [...] -> [...]."""
    xp = array_namespace(distance_3d_m)
    return alpha_db + 10.0 * beta * xp.log10(distance_3d_m)


def los_probability(distance_2d_m: Array, altitude_m: float, radio: Radio) -> Array:
    """Eq. 2, probability that no person blocks the line of sight: [...] -> [...] in [0, 1]."""
    xp = array_namespace(distance_2d_m)
    height_ratio = (radio.user_height_m - radio.device_height_m) / (altitude_m - radio.device_height_m)
    return xp.exp(-radio.blockers_per_m2 * radio.user_width_m * height_ratio * distance_2d_m)


def coupling_loss_db(distance_2d_m: Array, altitude_m: float, radio: Radio) -> Array:
    """Mean path loss less antenna gains, the left side of Eq. 3's condition: [...] -> [...].

    The distance of Eq. 1 is between UAV (height ``altitude_m``) and user (height 0, Section III).
    """
    xp = array_namespace(distance_2d_m)
    squared = distance_2d_m * distance_2d_m + altitude_m * altitude_m
    distance_3d_m = xp.sqrt(xp.where(squared < MIN_DISTANCE_M, squared * 0.0 + MIN_DISTANCE_M, squared))
    p_los = los_probability(distance_2d_m, altitude_m, radio)
    los_db = path_loss_db(distance_3d_m, radio.alpha_los_db, radio.beta_los)
    nlos_db = path_loss_db(distance_3d_m, radio.alpha_nlos_db, radio.beta_nlos)
    return p_los * los_db + (1.0 - p_los) * nlos_db - radio.g_tx_db - radio.g_rx_db


def serving_radius_m(altitude_m: float, radio: Radio, limit_m: float = 20_000.0) -> float:
    """Greatest horizontal distance at which a user is served, by bisection; 0 when none, at most ``limit_m``.

    Valid because the loss grows with distance for every radio that :func:`check_radio` accepts.
    """
    if _coupling_loss_at_db(0.0, altitude_m, radio) > radio.mcl_db:
        return 0.0
    low_m, high_m = 0.0, limit_m
    for _ in range(60):
        middle_m = 0.5 * (low_m + high_m)
        if _coupling_loss_at_db(middle_m, altitude_m, radio) <= radio.mcl_db:
            low_m = middle_m
        else:
            high_m = middle_m
    return low_m


def check_radio(altitude_m: float, radio: Radio) -> None:
    """Raise ValueError unless blockage only ever adds loss, so that loss grows with distance."""
    if not altitude_m > radio.user_height_m >= radio.device_height_m >= 0.0:
        raise ValueError(
            f"heights must satisfy altitude_m ({altitude_m}) > user_height_m ({radio.user_height_m})"
            f" >= device_height_m ({radio.device_height_m}) >= 0"
        )
    if min(radio.beta_los, radio.beta_nlos) <= 0.0:
        raise ValueError("beta_los and beta_nlos must be positive: loss grows with distance")
    for distance_m in (altitude_m, 20_000.0):
        log_m = 10.0 * math.log10(max(distance_m, MIN_DISTANCE_M))
        if radio.alpha_nlos_db + radio.beta_nlos * log_m < radio.alpha_los_db + radio.beta_los * log_m:
            raise ValueError(f"NLoS loss is below LoS loss at {distance_m:g} m; raise alpha_nlos_db or beta_nlos")


def served(distance_2d_m: Array, uav_active: Array, altitude_m: float, radio: Radio) -> Array:
    """Def. 1: users whose coupling loss to the nearest flying UAV is at most MCL.

    ``distance_2d_m`` [..., U, M], ``uav_active`` bool [..., U] -> bool [..., M].
    """
    xp = array_namespace(distance_2d_m)
    in_reach = coupling_loss_db(distance_2d_m, altitude_m, radio) <= radio.mcl_db
    return xp.any(in_reach & uav_active[..., None], axis=-2)


def _coupling_loss_at_db(distance_2d_m: float, altitude_m: float, radio: Radio) -> float:
    return float(coupling_loss_db(np.asarray(distance_2d_m, dtype=np.float64), altitude_m, radio))
