"""Propulsion energy of a rotary-wing UAV (Section III, after [25] of the paper)."""

from policy.world.arrays import Array, array_namespace

# Paper, Section VII-A.
C1_BLADE_W = 79.8563
C2_INDUCED_W = 88.6279
C3_PARASITE_W_PER_MPS3 = 0.0185
TIP_SPEED_MPS = 120.0
ROTOR_SPEED_MPS = 4.03  # mean rotor induced velocity in hover


def propulsion_power_w(speed_mps: Array) -> Array:
    """Blade, induced and parasite power at a level speed: [...] -> [...]."""
    xp = array_namespace(speed_mps)
    squared = speed_mps * speed_mps
    blade_w = C1_BLADE_W * (1.0 + 3.0 * squared / TIP_SPEED_MPS**2)
    ratio = squared / (2.0 * ROTOR_SPEED_MPS**2)
    # sqrt(1 + x^2) - x, written so that it keeps its digits at high speed.
    induced_w = C2_INDUCED_W * xp.sqrt(1.0 / (xp.sqrt(1.0 + ratio * ratio) + ratio))
    return blade_w + induced_w + 0.5 * C3_PARASITE_W_PER_MPS3 * speed_mps * squared


def battery_energy_j(capacity_mah: float, voltage_v: float) -> float:
    """Energy of a full battery: 4500 mAh at 22.2 V is 359,640 J."""
    return capacity_mah / 1000.0 * 3600.0 * voltage_v


def used_energy_j(speed_mps: Array, duration_s: float) -> Array:
    """Energy over ``duration_s`` for speeds sampled evenly, ends included: [..., K] -> [...] (trapezoid)."""
    xp = array_namespace(speed_mps)
    power_w = propulsion_power_w(speed_mps)
    mean_w = 0.5 * (power_w[..., 1:] + power_w[..., :-1])
    return duration_s * xp.mean(mean_w, axis=-1)
