"""A few thousand random cases of the gate's long test (`make gate-long`), over airframes, wishes and gusts."""

from gate_simulation import run


def test_no_breach_and_no_dead_end_in_random_cases() -> None:
    sums = run(1200, seed=20_000, size=100)
    assert sums == {"cases": 1200, "geofence": 0, "obstacle": 0, "separation": 0, "deadlock": 0}
