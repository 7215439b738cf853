"""How a UAV moves within a slot: toward the commanded velocity at limited acceleration, then steadily.

With an infinite limit this is the paper's motion, v tau in any direction. The velocity changes along the
straight line between old and new velocity at ``max_accel_mps2``, which is what a multirotor held to a lean
angle does.
"""

from policy.world.arrays import Array, array_namespace, norm

SAMPLES_PER_SLOT = 31
"""Points of a slot's path, ends included: 0.5 s apart in a slot of 15 s."""


def change_time_s(vel_from_mps: Array, vel_to_mps: Array, max_accel_mps2: float) -> Array:
    """Time until the new velocity is reached: [..., 2], [..., 2] -> [...]; 0 for an infinite limit."""
    return norm(vel_to_mps - vel_from_mps) / max_accel_mps2


def velocity_mps(vel_from_mps: Array, vel_to_mps: Array, max_accel_mps2: float, time_s: Array) -> Array:
    """Velocity after ``time_s`` [...]: velocities [..., 2] -> [..., 2]."""
    remaining, _ = _remaining(vel_from_mps, vel_to_mps, max_accel_mps2, time_s)
    return vel_to_mps - remaining[..., None] * (vel_to_mps - vel_from_mps)


def displacement_m(vel_from_mps: Array, vel_to_mps: Array, max_accel_mps2: float, time_s: Array) -> Array:
    """Way travelled in ``time_s`` [...]: velocities [..., 2] -> [..., 2]."""
    _, lag_s = _remaining(vel_from_mps, vel_to_mps, max_accel_mps2, time_s)
    return vel_to_mps * time_s[..., None] - lag_s[..., None] * (vel_to_mps - vel_from_mps)


def slot_times_s(like: Array, slot_s: float, samples: int = SAMPLES_PER_SLOT) -> Array:
    """Evenly spaced times of a slot [samples], in the library, type and device of ``like``."""
    xp = array_namespace(like)
    return xp.arange(samples, dtype=like.dtype, device=like.device) * (slot_s / (samples - 1))


def slot_path_m(
    pos_m: Array, vel_from_mps: Array, vel_to_mps: Array, max_accel_mps2: float, slot_s: float
) -> tuple[Array, Array]:
    """Path and speed through a slot: [..., 2] each -> positions [..., K, 2] and speeds [..., K]."""
    times_s = slot_times_s(pos_m, slot_s)
    start, goal = vel_from_mps[..., None, :], vel_to_mps[..., None, :]
    path_m = pos_m[..., None, :] + displacement_m(start, goal, max_accel_mps2, times_s)
    return path_m, norm(velocity_mps(start, goal, max_accel_mps2, times_s))


def stopping_point_m(pos_m: Array, vel_mps: Array, max_accel_mps2: float, reaction_s: float = 0.0) -> Array:
    """Where full braking after ``reaction_s`` comes to rest: [..., 2], [..., 2] -> [..., 2]."""
    way_s = reaction_s + norm(vel_mps) / (2.0 * max_accel_mps2)
    return pos_m + vel_mps * way_s[..., None]


def _remaining(vel_from_mps: Array, vel_to_mps: Array, max_accel_mps2: float, time_s: Array) -> tuple[Array, Array]:
    """Share of the velocity change still to come, and its integral over time in seconds."""
    xp = array_namespace(vel_from_mps, vel_to_mps)
    total_s = change_time_s(vel_from_mps, vel_to_mps, max_accel_mps2)
    total_s, time_s = xp.broadcast_arrays(total_s, time_s)
    changing = total_s > 0.0
    safe_total_s = xp.where(changing, total_s, xp.ones_like(total_s))
    spent_s = xp.where(time_s < total_s, time_s, total_s)
    share = xp.where(changing, 1.0 - spent_s / safe_total_s, xp.zeros_like(total_s))
    return share, spent_s - spent_s * spent_s / (2.0 * safe_total_s)
