"""Curves over the slots of a campaign, and sums by UAV and user."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gcs.ports import SlotRecord
from gcs.report.data import ReportData
from policy.world.arrays import FloatArray


@dataclass(frozen=True)
class Series:
    """Index t of each [T] list is the end of slot t+1; ``*_so_far`` are the metrics over all slots until then."""

    slot: tuple[int, ...]
    mean_aoi_slots: tuple[float, ...]  # over users, at that moment
    max_aoi_slots: tuple[float, ...]
    aoi_so_far: tuple[float, ...]  # kappa
    collected_so_far: tuple[float, ...]  # psi
    served: tuple[float, ...]  # fraction of the users, in that slot
    coverage_so_far: tuple[float, ...]  # rho
    energy_so_far: tuple[float, ...]  # zeta
    decision_ms: tuple[float | None, ...]


@dataclass(frozen=True)
class UavTotal:
    """What one UAV did."""

    system_id: int
    distance_m: float  # straight lines between the ends of slots
    mean_speed_mps: float
    energy_j: float
    energy_share: float  # of its battery
    slots_active: int


@dataclass(frozen=True)
class UserTotal:
    """How one user fared."""

    user_id: str
    mean_aoi_slots: float
    max_aoi_slots: float
    served_share: float  # of the slots
    waiting_mb: float  # not uploaded at the end


def series(data: ReportData) -> Series:
    """Curves over the slots that have metrics."""
    records = [record for record in data.flown if record.metrics is not None]
    metrics = [record.metrics for record in records if record.metrics is not None]
    aoi = [_aoi_slots(record) for record in records]
    return Series(
        slot=tuple(record.slot for record in records),
        mean_aoi_slots=tuple(float(np.mean(values)) for values in aoi),
        max_aoi_slots=tuple(float(np.max(values)) for values in aoi),
        aoi_so_far=tuple(m.episodic_aoi for m in metrics),
        collected_so_far=tuple(m.data_collection_ratio for m in metrics),
        served=tuple(float(np.mean([user.served for user in record.users])) for record in records),
        coverage_so_far=tuple(m.user_coverage for m in metrics),
        energy_so_far=tuple(m.energy_ratio for m in metrics),
        decision_ms=tuple(record.decision_ms for record in records),
    )


def uav_totals(data: ReportData) -> tuple[UavTotal, ...]:
    """One row a UAV, in the order of the first record."""
    return tuple(_uav_total(data, index) for index in range(len(data.records[0].uavs)))


def user_totals(data: ReportData) -> tuple[UserTotal, ...]:
    """One row a user, those who waited longest first."""
    if not data.flown:
        return ()
    aoi = np.stack([_aoi_slots(record) for record in data.flown])  # [T, M]
    served = np.asarray([[user.served for user in record.users] for record in data.flown])
    rows = [
        UserTotal(user.user_id, float(mean), float(longest), float(share), user.data_mb)
        for user, mean, longest, share in zip(
            data.flown[-1].users, aoi.mean(axis=0), aoi.max(axis=0), served.mean(axis=0), strict=True
        )
    ]
    return tuple(sorted(rows, key=lambda row: -row.mean_aoi_slots))


def decision_percentiles_ms(times_ms: Sequence[float | None]) -> tuple[float, float] | None:
    """Median and 99th percentile of the known decision times."""
    known = [value for value in times_ms if value is not None]
    if not known:
        return None
    p50, p99 = np.percentile(known, [50, 99])
    return float(p50), float(p99)


def _aoi_slots(record: SlotRecord) -> FloatArray:
    return np.asarray([user.aoi_slots for user in record.users], dtype=np.float64)


def _uav_total(data: ReportData, index: int) -> UavTotal:
    track = [record.uavs[index] for record in data.records]
    legs_m = [math.dist((a.east_m, a.north_m), (b.east_m, b.north_m)) for a, b in pairwise(track)]
    duration_s = data.scenario.slot_s * (data.records[-1].slot - data.records[0].slot)
    return UavTotal(
        system_id=track[-1].system_id,
        distance_m=sum(legs_m),
        mean_speed_mps=sum(legs_m) / duration_s if duration_s else 0.0,
        energy_j=track[-1].energy_j,
        energy_share=track[-1].energy_j / data.scenario.battery_j,
        slots_active=sum(uav.active for uav in track[1:]),
    )
