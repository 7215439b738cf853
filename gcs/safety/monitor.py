"""Counts what must not happen, from where the vehicles really were: the report's violations."""

import math
from collections.abc import Sequence

import numpy as np

from gcs.ports import UavTrack
from gcs.safety.envelope import Envelope
from policy.world.geometry import inside_polygon

RULES = ("geofence", "separation", "obstacle", "battery")
MIN_APART_M = 5.0  # in space: layers are as far apart
VERTICAL_TOLERANCE_M = 2.0  # a layer is held this well; nearer in height counts as one height


class ViolationMonitor:
    """UAV-slots in which a rule was broken at any tick."""

    def __init__(self, envelope: Envelope) -> None:
        self._envelope = envelope
        self._boxes = [_box(polygon) for polygon in envelope.obstacles]
        self._open: set[tuple[str, int]] = set()
        self.counts = dict.fromkeys(RULES, 0)

    def tick(self, tracks: Sequence[UavTrack]) -> None:
        """Tracks of the UAVs in the air at their layers."""
        width_m, height_m = self._envelope.size_m
        for i, track in enumerate(tracks):
            east_m, north_m = track.east_m, track.north_m
            if not (0.0 <= east_m <= width_m and 0.0 <= north_m <= height_m):
                self._open.add(("geofence", track.system_id))
            if self._boxes and self._hits(east_m, north_m):
                self._open.add(("obstacle", track.system_id))
            for other in tracks[i + 1 :]:
                if _too_close(track, other):
                    self._open.add(("separation", track.system_id))

    def end_slot(self, empty_ids: Sequence[int] = ()) -> dict[str, int]:
        """Close a slot; ``empty_ids``: UAVs whose battery ran empty in it. Returns what the slot added."""
        self._open.update(("battery", system_id) for system_id in empty_ids)
        added = {rule: sum(1 for name, _ in self._open if name == rule) for rule in RULES}
        self._open.clear()
        for rule, count in added.items():
            self.counts[rule] += count
        return added

    def _hits(self, east_m: float, north_m: float) -> bool:
        for (west, south, east, north), polygon in zip(self._boxes, self._envelope.obstacles, strict=True):
            near = west <= east_m <= east and south <= north_m <= north
            if near and bool(inside_polygon(np.array([east_m, north_m]), polygon)):
                return True
        return False


def _too_close(first: UavTrack, second: UavTrack) -> bool:
    if abs(first.alt_home_m - second.alt_home_m) > MIN_APART_M - VERTICAL_TOLERANCE_M:
        return False
    return math.hypot(first.east_m - second.east_m, first.north_m - second.north_m) < MIN_APART_M


def _box(polygon: Sequence[tuple[float, float]]) -> tuple[float, float, float, float]:
    easts, norths = [p[0] for p in polygon], [p[1] for p in polygon]
    return min(easts), min(norths), max(easts), max(norths)
