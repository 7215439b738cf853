"""What a phone reports of a true path: fixes at intervals, with errors that stay or jump, maybe on a lattice.

Two of the three real sets were fixed every 30 s and repeat each fix in 15 s rows, the third lies on a lattice
of about 8.4 x 10.2 m: much of what looks like standing or like steps is the receiver's doing.
"""

from dataclasses import dataclass

import numpy as np

from policy.mobility.ground import Ground
from policy.world.arrays import BoolArray, FloatArray


@dataclass(frozen=True)
class ReceiverParams:
    """Errors of position fixes."""

    interval_samples: int = 2  # a fix every so many samples, repeated in between
    error_m: float = 4.0  # standard deviation on each axis of a median user
    error_spread: float = 0.5  # log-normal spread of that from user to user
    jump_probability: float = 0.6  # of a new error, at a fix, while its user stands: mean over users
    jump_concentration: float = 0.7  # of that over users (beta distribution): near 0 all are steady or restless
    lattice_m: tuple[float, float] = (0.0, 0.0)  # east, north spacing that fixes are rounded to; 0: none


def observe(
    rng: np.random.Generator, ground: Ground, true_m: FloatArray, still: BoolArray, receiver: ReceiverParams
) -> FloatArray:
    """True places [N, M, 2] to reported ones [N, M, 2]; users in ``still`` [M] report one place throughout."""
    num_samples, num_users, _ = true_m.shape
    error_m = receiver.error_m * np.exp(receiver.error_spread * rng.standard_normal((num_users, 1)))
    jump_probability = _jump_probabilities(rng, num_users, receiver)
    seen_m = np.empty_like(true_m)
    for sample in range(num_samples):
        if sample % receiver.interval_samples:
            seen_m[sample] = seen_m[sample - 1]
            continue
        noisy = true_m[sample] + error_m * rng.standard_normal((num_users, 2))
        fix_m = _on_ground(ground, _rounded(noisy, receiver.lattice_m), true_m[sample])
        renewed = rng.random(num_users) < jump_probability
        if sample:
            moved = np.any(true_m[sample] != true_m[sample - receiver.interval_samples], axis=-1)
            fix_m = np.where(((renewed | moved) & ~still)[:, None], fix_m, seen_m[sample - 1])
        seen_m[sample] = fix_m
    return seen_m


def _jump_probabilities(rng: np.random.Generator, num_users: int, receiver: ReceiverParams) -> FloatArray:
    """[M]; in the real sets some phones never repeat a fix and others hardly ever change one."""
    mean, total = receiver.jump_probability, receiver.jump_concentration
    if mean in {0.0, 1.0}:
        return np.full(num_users, mean)
    return rng.beta(mean * total, (1.0 - mean) * total, size=num_users)


def _rounded(points_m: FloatArray, lattice_m: tuple[float, float]) -> FloatArray:
    columns = [
        np.round(points_m[:, axis] / step) * step if step > 0.0 else points_m[:, axis]
        for axis, step in enumerate(lattice_m)
    ]
    return np.stack(columns, axis=-1)


def _on_ground(ground: Ground, fix_m: FloatArray, true_m: FloatArray) -> FloatArray:
    """An error never puts anybody off the ground: the true place is reported instead."""
    return np.where(ground.free(fix_m)[:, None], fix_m, true_m)
