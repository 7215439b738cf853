"""The trajectory file: where everyone was after each slot, enough to recompute the four metrics.

One row a UAV and one a user for slots 0..T. A UAV's heading and speed are those of the way it made in the slot,
as the crow flies over the slot's time; in the paper's motion these are the commanded ones.
"""

import csv
import io
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from policy.evaluation.files import write_text
from policy.evaluation.rollout import CampaignRecord
from policy.world.arrays import FloatArray
from policy.world.frames import heading_rad

HEADER = "slot,kind,id,east_m,north_m,heading_deg,speed_mps,energy_j,aoi,data_mb,served"
AT_REST_MPS = 1e-6
"""Slower than this is rounding, not a direction of travel."""


@dataclass(frozen=True)
class UavRow:
    """One UAV after ``slot`` slots; ``energy_j`` used since slot 0."""

    slot: int
    uav_id: str
    east_m: float
    north_m: float
    heading_deg: float
    speed_mps: float
    energy_j: float


@dataclass(frozen=True)
class UserRow:
    """One user after ``slot`` slots; ``served`` at the end of that slot."""

    slot: int
    user_id: str
    east_m: float
    north_m: float
    aoi_slots: float
    data_mb: float
    served: bool


def campaign_rows(record: CampaignRecord, user_ids: Sequence[str]) -> Iterator[UavRow | UserRow]:
    """Rows of a flown campaign in the order of the file; UAVs are numbered from 1 like system ids."""
    spent_j = np.zeros(record.scenario.num_uavs)
    for slot, state in enumerate(record.states):
        headings_deg, speeds_mps = _flown(record, slot)
        if slot > 0:
            spent_j = spent_j + record.outcomes[slot - 1].energy_j
        for uav, (east_m, north_m) in enumerate(state.uav_pos_enu_m):
            motion = (float(headings_deg[uav]), float(speeds_mps[uav]), float(spent_j[uav]))
            yield UavRow(slot, str(uav + 1), float(east_m), float(north_m), *motion)
        served = record.outcomes[slot - 1].served if slot > 0 else np.zeros(len(user_ids), dtype=np.bool_)
        for user, (east_m, north_m) in enumerate(state.user_pos_enu_m):
            fresh = (float(state.user_aoi_slots[user]), float(state.user_data_mb[user]), bool(served[user]))
            yield UserRow(slot, user_ids[user], float(east_m), float(north_m), *fresh)


def trajectory_text(rows: Iterable[UavRow | UserRow]) -> str:
    """The CSV with its header; cells that do not apply are empty."""
    buffer = io.StringIO()
    buffer.write(HEADER + "\n")
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerows(_cells(row) for row in rows)
    return buffer.getvalue()


def write_trajectory(path: Path, rows: Iterable[UavRow | UserRow]) -> None:
    """Write the CSV at once. Raises :class:`~policy.evaluation.files.OutputError`."""
    write_text(path, trajectory_text(rows))


def _cells(row: UavRow | UserRow) -> list[object]:
    place: list[object] = [_number(row.east_m), _number(row.north_m)]
    if isinstance(row, UavRow):
        heading = _number(row.heading_deg % 360.0)
        motion: list[object] = ["0" if heading == "360" else heading, _number(row.speed_mps), _number(row.energy_j)]
        return [row.slot, "uav", row.uav_id, *place, *motion, "", "", ""]
    fresh: list[object] = [_number(row.aoi_slots), _number(row.data_mb), int(row.served)]
    return [row.slot, "user", row.user_id, *place, "", "", "", *fresh]


def _number(value: float) -> str:
    """Micrometres and microjoules are enough, and without trailing zeros a person can read the file."""
    text = f"{value:.6f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _flown(record: CampaignRecord, slot: int) -> tuple[FloatArray, FloatArray]:
    """Heading (degrees) and speed [U] of the way made to get to the state after ``slot`` slots."""
    if slot == 0:
        still = np.zeros(record.scenario.num_uavs)
        return still, still
    way_m = record.states[slot].uav_pos_enu_m - record.states[slot - 1].uav_pos_enu_m
    vel_mps = np.asarray(way_m, dtype=np.float64) / record.scenario.slot_s
    speed_mps = np.hypot(vel_mps[:, 0], vel_mps[:, 1])
    headings = np.where(speed_mps > AT_REST_MPS, heading_rad(vel_mps), 0.0)
    return headings * (180.0 / math.pi), speed_mps
