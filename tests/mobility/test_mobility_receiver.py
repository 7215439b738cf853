"""Fixes come at intervals, repeat, jump and lie on lattices as the parameters say."""

import numpy as np
import numpy.typing as npt

from policy.mobility.ground import Ground
from policy.mobility.receiver import ReceiverParams, observe

GROUND = Ground((1000.0, 1000.0))
MOVING = 200.0 + 5.0 * np.arange(20.0)[:, None, None] + np.zeros((20, 3, 2))
STANDING = np.full((400, 50, 2), 500.0)


def seen(true_m: npt.NDArray[np.float64], still: bool = False, **params: object) -> npt.NDArray[np.float64]:
    receiver = ReceiverParams(**params)  # type: ignore[arg-type]
    return observe(np.random.default_rng(1), GROUND, true_m, np.full(true_m.shape[1], still), receiver)


def test_without_errors_the_truth_is_seen() -> None:
    np.testing.assert_array_equal(seen(MOVING, interval_samples=1, error_m=0.0), MOVING)


def test_a_fix_is_repeated_until_the_next() -> None:
    fixes = seen(MOVING, interval_samples=4, error_m=0.0)
    np.testing.assert_array_equal(fixes, np.repeat(MOVING[::4], 4, axis=0))


def test_errors_have_the_stated_size_and_change_as_often_as_stated() -> None:
    fixes = seen(STANDING, interval_samples=1, error_m=4.0, error_spread=0.0, jump_probability=0.25)
    assert abs(float(np.std(fixes - STANDING)) - 4.0) < 0.2
    changed = np.any(np.diff(fixes, axis=0) != 0.0, axis=-1)
    assert abs(float(changed.mean()) - 0.25) < 0.07


def test_who_never_moves_reports_one_place() -> None:
    fixes = seen(STANDING, still=True, jump_probability=1.0)
    np.testing.assert_array_equal(fixes, np.broadcast_to(fixes[0], fixes.shape))


def test_fixes_lie_on_the_lattice() -> None:
    fixes = seen(STANDING, error_m=20.0, lattice_m=(8.0, 10.0))
    np.testing.assert_array_equal(np.mod(fixes, [8.0, 10.0]), 0.0)


def test_errors_never_leave_the_ground() -> None:
    corner = np.zeros((50, 5, 2))
    assert np.all(GROUND.free(seen(corner, error_m=30.0, lattice_m=(7.0, 7.0))))
