"""Slot records as the trajectory CSV of the contract: one row a UAV and one a user, for slot 0 to T."""

import csv
import io
from collections.abc import Iterable, Iterator

from gcs.ports import SlotRecord, UavSlot, UserSlot

COLUMNS = (
    "slot", "kind", "id", "east_m", "north_m", "heading_deg", "speed_mps", "energy_j", "aoi", "data_mb", "served",
)  # fmt: skip


def trajectory_csv(records: Iterable[SlotRecord]) -> str:
    """The file's text. Cells that a kind of row has no value for stay empty."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    for record in records:
        writer.writerows(_rows(record))
    return buffer.getvalue()


def _rows(record: SlotRecord) -> Iterator[tuple[object, ...]]:
    yield from (_uav_row(record.slot, uav) for uav in record.uavs)
    yield from (_user_row(record.slot, user) for user in record.users)


def _uav_row(slot: int, uav: UavSlot) -> tuple[object, ...]:
    numbers = (uav.east_m, uav.north_m, uav.heading_deg, uav.speed_mps, uav.energy_j)
    return (slot, "uav", uav.system_id, *map(_exact, numbers), "", "", "")


def _user_row(slot: int, user: UserSlot) -> tuple[object, ...]:
    place = (_exact(user.east_m), _exact(user.north_m))
    return (
        slot,
        "user",
        user.user_id,
        *place,
        "",
        "",
        "",
        _exact(user.aoi_slots),
        _exact(user.data_mb),
        int(user.served),
    )


def _exact(value: float) -> str:
    """Shortest text that reads back as the same number, so that metrics recomputed from the file are equal."""
    return repr(float(value))
