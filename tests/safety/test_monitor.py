"""Violations are counted once a UAV and slot."""

import pytest

from gcs.ports import UavTrack
from gcs.safety.envelope import Envelope
from gcs.safety.monitor import ViolationMonitor

WALL = ((100.0, 100.0), (200.0, 100.0), (150.0, 200.0))


def track(system_id: int, east: float, north: float, alt: float = 100.0) -> UavTrack:
    return UavTrack(system_id, east, north, alt, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("tracks", "rule"),
    [
        ([track(1, -0.1, 50.0)], "geofence"),
        ([track(1, 500.1, 50.0)], "geofence"),
        ([track(1, 150.0, 130.0)], "obstacle"),
        ([track(1, 300.0, 300.0), track(2, 303.0, 300.0)], "separation"),
    ],
)
def test_one_rule_broken(tracks: list[UavTrack], rule: str) -> None:
    monitor = ViolationMonitor(Envelope((500.0, 500.0), (WALL,)))
    for _ in range(7):
        monitor.tick(tracks)
    added = monitor.end_slot()
    assert {name for name, count in added.items() if count} == {rule}
    assert monitor.counts[rule] == 1
    assert not any(monitor.end_slot().values())


def test_layers_corners_and_boxes_break_nothing() -> None:
    monitor = ViolationMonitor(Envelope((500.0, 500.0), (WALL,)))
    monitor.tick([track(1, 0.0, 500.0), track(2, 105.0, 190.0), track(3, 300.0, 300.0), track(4, 300.0, 300.0, 105.0)])
    assert not any(monitor.end_slot().values())


def test_an_empty_battery_counts() -> None:
    monitor = ViolationMonitor(Envelope((500.0, 500.0)))
    assert monitor.end_slot([2])["battery"] == 1
