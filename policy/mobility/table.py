"""A trace file's rows as columns: CSV text to arrays, with the line of whatever is wrong.

Rows are read in chunks, so a file of 10^6 rows needs seconds and little memory.
"""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from policy.mobility.traces import TraceError
from policy.world.arrays import FloatArray, IntArray

METRES = ("x_distance", "y_distance")
DEGREES = ("longitude", "latitude")
MISSING = frozenset({"", "na", "n/a", "null", "none", "-"})
CHUNK_ROWS = 50_000
MAX_USERS = 10_000
"""Above this the positions of one campaign no longer fit a small machine: most likely a wrong id column."""
LARGEST_NUMBER = 1e20
"""No time or place is beyond this; larger numbers would overflow later."""

Row = Sequence[str]


@dataclass(frozen=True)
class TraceTable:
    """R rows of a file, as they stand there; NaN where a number is missing."""

    user_ids: tuple[str, ...]  # by order of appearance
    user: IntArray  # [R] index into user_ids
    time_s: FloatArray  # [R]
    position: FloatArray  # [R, 2] east, north metres; or longitude, latitude degrees if ``geodetic``
    line: IntArray  # [R] line in the file
    geodetic: bool


def read_table(path: Path) -> TraceTable:
    """Columns ``id, timestamp`` and ``x_distance, y_distance`` (or ``longitude, latitude``), in any order."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return _parse(csv.reader(file), path.name)
    except UnicodeDecodeError as error:
        raise TraceError(f"{path.name}: not UTF-8 text (byte {error.start}): save it as CSV in UTF-8") from None
    except csv.Error as error:
        raise TraceError(f"{path.name}: not CSV ({error}): save it as comma-separated text") from None
    except OSError as error:
        raise TraceError(f"{path}: cannot be read ({error.strerror}): check the path and its rights") from None


def _parse(reader: Iterator[list[str]], name: str) -> TraceTable:
    header = [column.strip().lower() for column in next(reader, [])]
    columns, geodetic = _columns(header, name)
    ids: dict[str, int] = {}
    users, numbers, lines = [], [], []
    for rows, row_lines in _chunks(reader, len(header), name):
        users.append(_user_indices([row[columns[0]].strip() for row in rows], row_lines, ids, name))
        parts = [_numbers([row[index] for row in rows], row_lines, header[index], name) for index in columns[1:]]
        numbers.append(np.stack(parts))
        lines.append(np.asarray(row_lines, dtype=np.int64))
    if not users:
        raise TraceError(f"{name}: no rows below the header: bring at least one fix a user")
    time_s, *position = np.concatenate(numbers, axis=1)
    user, line = np.concatenate(users), np.concatenate(lines)
    return TraceTable(tuple(ids), user, time_s, np.stack(position, axis=-1), line, geodetic)


def _columns(header: list[str], name: str) -> tuple[list[int], bool]:
    """Where id, timestamp, east, north stand; metres are taken when both kinds are there."""
    for place, geodetic in ((METRES, False), (DEGREES, True)):
        wanted = ["id", "timestamp", *place]
        if all(column in header for column in wanted):
            repeated = [column for column in wanted if header.count(column) > 1]
            if repeated:
                raise TraceError(f"{name}:1: column {repeated[0]!r} stands twice: keep one")
            return [header.index(column) for column in wanted], geodetic
    found = ", ".join(header)[:80] or "nothing"
    raise TraceError(
        f"{name}:1: the header needs id, timestamp and x_distance, y_distance (or longitude, latitude), "
        f"found {found!a}: name the columns so"
    )


def _chunks(reader: Iterator[list[str]], width: int, name: str) -> Iterator[tuple[list[Row], Sequence[int]]]:
    """Rows with the number of their line; blank lines are passed over."""
    first = 2
    while rows := list(islice(reader, CHUNK_ROWS)):
        lines: Sequence[int] = range(first, first + len(rows))
        first += len(rows)
        kept: list[Row] = list(rows)
        if set(map(len, rows)) != {width}:
            pairs = [(row, line) for row, line in zip(rows, lines, strict=True) if any(map(str.strip, row))]
            _check_widths(pairs, width, name)
            kept, lines = [row for row, _ in pairs], [line for _, line in pairs]
        if kept:
            yield kept, lines


def _check_widths(pairs: list[tuple[list[str], int]], width: int, name: str) -> None:
    for row, line in pairs:
        if len(row) != width:
            raise TraceError(f"{name}:{line}: {len(row)} fields where the header has {width}: complete the row")


def _user_indices(texts: list[str], lines: Sequence[int], ids: dict[str, int], name: str) -> IntArray:
    for text in dict.fromkeys(texts):
        ids.setdefault(text, len(ids))
    if "" in ids:
        raise TraceError(f"{name}:{lines[texts.index('')]}: a row without an id: say whose fix it is")
    if len(ids) > MAX_USERS:
        raise TraceError(f"{name}: more than {MAX_USERS} users: check the id column, or bring fewer")
    return np.fromiter(map(ids.__getitem__, texts), dtype=np.int64, count=len(texts))


def _numbers(texts: list[str], lines: Sequence[int], column: str, name: str) -> FloatArray:
    """[R] numbers; NaN for what is missing, not finite or absurd."""
    try:
        values = np.fromiter(map(float, texts), dtype=np.float64, count=len(texts))
    except ValueError:
        parsed = (_number(text, line, column, name) for text, line in zip(texts, lines, strict=True))
        values = np.fromiter(parsed, dtype=np.float64, count=len(texts))
    return np.where(np.abs(values) < LARGEST_NUMBER, values, np.nan)


def _number(text: str, line: int, column: str, name: str) -> float:
    if text.strip().lower() in MISSING:
        return float("nan")
    try:
        return float(text)
    except ValueError:
        raise TraceError(f"{name}:{line}: {column} {text[:40]!a} is not a number: write it as 12.5") from None
