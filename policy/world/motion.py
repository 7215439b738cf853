"""How a UAV moves within a slot: toward the commanded velocity at limited acceleration, then steadily.

With an infinite limit this is the paper's motion, v tau in any direction. The velocity changes along the
straight line between old and new velocity at ``max_accel_mps2``, which is what a multirotor held to a lean
angle does. A slot may also end on the way into the next one (*pre-turn*): then a second change of velocity begins
as late as it can and is complete when the slot ends.
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


def slot_motion(
    vel_from_mps: Array,
    vel_to_mps: Array,
    vel_end_mps: Array | None,
    max_accel_mps2: float,
    slot_s: float,
    time_s: Array,
) -> tuple[Array, Array]:
    """Way [..., 2] and velocity [..., 2] after ``time_s`` [...] of a slot that ends at ``vel_end_mps``.

    None: the slot ends at the velocity commanded. The turn into ``vel_end_mps`` begins as late as it can, but not
    before ``vel_to_mps`` is reached: what is too much for one slot is not complete when it ends.
    """
    way_m = displacement_m(vel_from_mps, vel_to_mps, max_accel_mps2, time_s)
    vel_mps = velocity_mps(vel_from_mps, vel_to_mps, max_accel_mps2, time_s)
    if vel_end_mps is None:
        return way_m, vel_mps
    xp = array_namespace(vel_from_mps, vel_to_mps)
    reached_s = change_time_s(vel_from_mps, vel_to_mps, max_accel_mps2)
    latest_s = slot_s - change_time_s(vel_to_mps, vel_end_mps, max_accel_mps2)
    begin_s = xp.where(latest_s > reached_s, latest_s, reached_s)
    begin_s, time_s = xp.broadcast_arrays(begin_s, time_s)
    turning = time_s > begin_s
    turning_s = xp.where(turning, time_s - begin_s, xp.zeros_like(begin_s))
    lead_m = displacement_m(vel_to_mps, vel_end_mps, max_accel_mps2, turning_s) - vel_to_mps * turning_s[..., None]
    turned_mps = velocity_mps(vel_to_mps, vel_end_mps, max_accel_mps2, turning_s)
    return way_m + lead_m, xp.where(turning[..., None], turned_mps, vel_mps)


def slot_path_m(
    pos_m: Array,
    vel_from_mps: Array,
    vel_to_mps: Array,
    max_accel_mps2: float,
    slot_s: float,
    vel_end_mps: Array | None = None,
) -> tuple[Array, Array]:
    """Path and speed through a slot: [..., 2] each -> positions [..., K, 2] and speeds [..., K]."""
    times_s = slot_times_s(pos_m, slot_s)
    start, goal = vel_from_mps[..., None, :], vel_to_mps[..., None, :]
    end = None if vel_end_mps is None else vel_end_mps[..., None, :]
    way_m, vel_mps = slot_motion(start, goal, end, max_accel_mps2, slot_s, times_s)
    return pos_m[..., None, :] + way_m, norm(vel_mps)


def end_velocity_mps(
    vel_from_mps: Array, vel_to_mps: Array, max_accel_mps2: float, slot_s: float, vel_end_mps: Array | None = None
) -> Array:
    """Velocity at the slot's end: [..., 2] each -> [..., 2]."""
    last_s = slot_times_s(vel_to_mps, slot_s)[-1]
    return slot_motion(vel_from_mps, vel_to_mps, vel_end_mps, max_accel_mps2, slot_s, last_s)[1]


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
