"""User traces from files: found, read, cleaned and brought onto the slot grid.

What is mended (rows left out are counted in ``UserTraces.notes``): rows without a number, rows in any order, rows
given twice, fixes more than 100 m outside the area (the paper's tolerance for GPS offsets, Section VI-A), gaps of
up to ``MAX_GAP_S`` (linear in between, held at the ends). What is refused, as :class:`TraceError`: everything else.
Fixes up to 100 m outside the area are kept as they are: users may step over the edge, UAVs may not.
"""

import os
from pathlib import Path

import numpy as np

from policy.mobility.table import TraceTable, read_table
from policy.mobility.traces import TraceError, UserTraces
from policy.world.arrays import BoolArray, FloatArray, IntArray
from policy.world.frames import LocalFrame
from policy.world.geometry import inside_rectangle

OUTSIDE_TOLERANCE_M = 100.0
"""Maximum tolerated position error (the paper, Section VI-A)."""
MAX_GAP_S = 300.0
"""Longest stretch without a fix that is bridged: at walking pace (1.4 m/s) a straight 420 m."""
DATA_DIR_VARIABLE = "UCS_DATA_DIR"
DEFAULT_DATA_DIR = Path(__file__).resolve().parents[3] / "shared" / "data" / "mobility"


def find_trace(name: str, mission_dir: Path | None) -> Path:
    """The file of a mission's ``trace``: by absolute path, beside the mission, or in ``UCS_DATA_DIR``."""
    data_dir = os.environ.get(DATA_DIR_VARIABLE)
    folders = [folder for folder in (mission_dir, Path(data_dir) if data_dir else DEFAULT_DATA_DIR) if folder]
    places = [Path(name)] if Path(name).is_absolute() else [folder / name for folder in folders]
    for place in places:
        if name.strip() and _is_file(place):
            return place
    looked = ", ".join(str(place.parent) for place in places)
    raise TraceError(f"trace {name!a} not found in {looked}: put it there, or set {DATA_DIR_VARIABLE}")


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long or with NUL, a folder without rights
        return False


def read_traces(
    path: Path,
    *,
    area_size_m: tuple[float, float],
    num_samples: int,
    slot_s: float,
    south_west_deg: tuple[float, float] | None = None,
) -> UserTraces:
    """Users' places at ``num_samples`` samples, ``slot_s`` apart, from the file's first time on.

    ``area_size_m`` is (east, north); ``south_west_deg`` (lat, lon) is needed where the file has degrees only.
    Users come in the order of their ids (numbers by value), whatever the order of the rows.
    """
    if num_samples < 1 or slot_s <= 0.0:
        raise ValueError(f"need at least one sample and a positive slot, got {num_samples}, {slot_s}")
    table = read_table(path)
    pos_enu_m = _metres(table, south_west_deg, path.name)
    usable, notes = _usable(table, pos_enu_m, area_size_m, path.name)
    order = _sorted_distinct(table, pos_enu_m, usable, path.name)
    if repeated := int(usable.sum()) - order.size:
        notes.append(f"{repeated} repeated rows dropped")
    ids, fixes = _by_user(table, order, path.name)
    start_s = float(table.time_s[order].min())
    paths = [
        _on_grid(table.time_s[rows] - start_s, pos_enu_m[rows], num_samples, slot_s, f"{path.name}: user {user!a}")
        for user, rows in zip(ids, fixes, strict=True)
    ]
    return UserTraces(ids, np.stack(paths, axis=1), slot_s, path.name, tuple(notes))


def _metres(table: TraceTable, south_west_deg: tuple[float, float] | None, name: str) -> FloatArray:
    """[R, 2] east, north."""
    if not table.geodetic:
        return table.position
    if south_west_deg is None:
        raise TraceError(f"{name}: longitude and latitude need the area's south_west corner: give it")
    east, north = LocalFrame(*south_west_deg).to_enu_m(table.position[:, 1], table.position[:, 0])
    return np.stack([east, north], axis=-1)


def _usable(
    table: TraceTable, pos_enu_m: FloatArray, area_size_m: tuple[float, float], name: str
) -> tuple[BoolArray, list[str]]:
    """Rows with a time and a place near the area, bool [R], and what that left out."""
    complete = np.isfinite(table.time_s) & np.isfinite(pos_enu_m).all(axis=-1)
    near = np.asarray(inside_rectangle(pos_enu_m, area_size_m, -OUTSIDE_TOLERANCE_M), dtype=np.bool_)
    far_off = complete & ~near
    if not np.any(complete & near):
        if np.any(far_off):
            line = int(table.line[far_off][0])
            raise TraceError(f"{name}:{line}: every position is outside the area: check south_west and size_m")
        raise TraceError(f"{name}: no row has both a time and a position: fill them in")
    counts = ((~complete, "rows without a number dropped"), (far_off, "positions far outside the area dropped"))
    return complete & near, [f"{int(mask.sum())} {what}" for mask, what in counts if np.any(mask)]


def _sorted_distinct(table: TraceTable, pos_enu_m: FloatArray, usable: BoolArray, name: str) -> IntArray:
    """Rows by user and time, the first of each moment; refuses one id at two places at once."""
    rows = np.flatnonzero(usable)
    north, east = pos_enu_m[rows, 1], pos_enu_m[rows, 0]
    order = rows[np.lexsort((north, east, table.time_s[rows], table.user[rows]))]
    same = (np.diff(table.user[order]) == 0) & (np.diff(table.time_s[order]) == 0)
    apart_m = np.linalg.norm(np.diff(pos_enu_m[order], axis=0), axis=-1)
    clash = np.flatnonzero(same & (apart_m > OUTSIDE_TOLERANCE_M))
    if clash.size:
        first, second = sorted(int(line) for line in table.line[order[clash[0] : clash[0] + 2]])
        raise TraceError(
            f"{name}:{second}: the id of line {first} at the same time, {apart_m[clash[0]]:.0f} m away: "
            "give each user an own id"
        )
    return np.asarray(order[np.concatenate(([True], ~same))], dtype=np.int64)


def _by_user(table: TraceTable, order: IntArray, name: str) -> tuple[tuple[str, ...], list[IntArray]]:
    """Ids in their order, and each one's rows by time."""
    present, starts = np.unique(table.user[order], return_index=True)
    if present.size < len(table.user_ids):
        lost = table.user_ids[np.setdiff1d(np.arange(len(table.user_ids)), present)[0]]
        raise TraceError(f"{name}: user {lost!a} has no usable row: mend or remove this user")
    rows = np.split(order, starts[1:])
    by_id = sorted(range(present.size), key=lambda user: _id_key(table.user_ids[user]))
    return tuple(table.user_ids[user] for user in by_id), [rows[user] for user in by_id]


def _id_key(user_id: str) -> tuple[int, int, str]:
    whole = user_id.isascii() and user_id.isdigit() and len(user_id) < 19
    return (0, int(user_id), user_id) if whole else (1, 0, user_id)


def _on_grid(time_s: FloatArray, pos_enu_m: FloatArray, num_samples: int, slot_s: float, who: str) -> FloatArray:
    """One user's fixes, [K] and [K, 2], at the slots' starts: [num_samples, 2]."""
    grid_s = slot_s * np.arange(num_samples)
    edges_s = np.unique(np.concatenate(([0.0], time_s, grid_s[-1:])))
    gap_s = np.diff(edges_s)[edges_s[:-1] < grid_s[-1]]
    if gap_s.size and gap_s.max() > MAX_GAP_S:
        worst = int(gap_s.argmax())
        raise TraceError(
            f"{who} has no fix from {edges_s[worst]:.0f} s to {edges_s[worst + 1]:.0f} s (at most "
            f"{MAX_GAP_S:.0f} s are bridged): fill the gap, remove the user, or fly fewer slots"
        )
    return np.stack([np.interp(grid_s, time_s, pos_enu_m[:, axis]) for axis in (0, 1)], axis=-1)
