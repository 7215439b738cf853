"""What is kept of the telemetry: of each vehicle what a page shows, in rows without names, about 170 bytes each.

Apart from the tables, so that a headless flight can write it into its report without a database.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum
from operator import attrgetter
from typing import Any

from gcs.ports import FlightMode, Landed, TelemetrySample, VehicleStatus
from gcs.store.jsonable import jsonable

DIGITS: Mapping[str, int] = {
    "system_id": 0,
    "autopilot": 0,
    "mode": 0,
    "mode_name": 0,
    "armed": 0,
    "landed": 0,
    "position_ready": 0,
    "lat_deg": 7,
    "lon_deg": 7,
    "alt_home_m": 1,
    "vel_ned_mps": 2,
    "yaw_rad": 3,
    "home_lat_deg": 7,
    "home_lon_deg": 7,
    "battery_fraction": 3,
    "battery_v": 2,
    "loss_ratio": 3,
    "heartbeat_s": 1,
    "position_s": 1,
}
"""Field of ports.VehicleStatus -> digits that are kept of its numbers. New ones go to the end: rows have no names."""
_VALUES = attrgetter(*DIGITS)


def vehicle_rows(vehicles: Sequence[VehicleStatus]) -> list[Any]:
    """A row a vehicle, values in the order of :data:`DIGITS`."""
    return [list(map(_kept, _VALUES(one), DIGITS.values())) for one in vehicles]


def vehicle_statuses(
    rows: Iterable[Sequence[Any]], columns: Sequence[str] = tuple(DIGITS)
) -> tuple[VehicleStatus, ...]:
    """The vehicles of rows; what another version kept more or less of is passed over or unknown.

    Raises KeyError, TypeError, ValueError for what are no rows of vehicles.
    """
    return tuple(_status(dict(zip(columns, row, strict=False))) for row in rows)


def telemetry_document(samples: Iterable[tuple[float, Sequence[Any]]]) -> dict[str, Any]:
    """For a file: of (time_s, rows)."""
    return {"columns": list(DIGITS), "samples": [[time_s, rows] for time_s, rows in samples]}


def telemetry_samples(document: Mapping[str, Any]) -> tuple[TelemetrySample, ...]:
    """What :func:`telemetry_document` wrote; raises as :func:`vehicle_statuses`."""
    columns = document["columns"]
    return tuple(TelemetrySample(float(at_s), vehicle_statuses(rows, columns)) for at_s, rows in document["samples"])


def _kept(value: Any, digits: int) -> Any:
    """Quick for the common kinds: 100 vehicles are 1,900 values, beside a flight loop that wants its turn."""
    kind = type(value)
    if kind is float:
        return round(value, digits) if math.isfinite(value) else None
    if value is None or kind is int or kind is bool:
        return value
    if kind is tuple:
        return [_kept(item, digits) for item in value]
    return value.value if isinstance(value, StrEnum) else jsonable(value)


def _status(known: dict[str, Any]) -> VehicleStatus:
    velocity = tuple(0.0 if part is None else float(part) for part in known.pop("vel_ned_mps"))
    if len(velocity) != 3:
        raise ValueError(f"a velocity has 3 parts, not {len(velocity)}")
    told = {name: value for name, value in known.items() if name in DIGITS and value is not None}
    told |= {"mode": FlightMode(told["mode"]), "landed": Landed(told["landed"]), "vel_ned_mps": velocity}
    return VehicleStatus(**told)
