"""A training's learning curve as a small CSV file: one line an episode, beside the checkpoint that came of it."""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from policy.model.checkpoint_error import CheckpointError

CURVE = "curve.csv"
"""In a folder that training wrote; beside a shipped checkpoint it is ``STEM.curve.csv``."""
DIGITS = 7
"""Kept of each figure: those of a 32-bit float."""


@dataclass(frozen=True)
class CurvePoint:
    """One episode."""

    episode: int  # from 1
    score: float  # its episodic AoI, slots
    mean_score: float  # of the last 20 episodes
    value_loss: float  # L_val (Eq. 16), mean over the episode's updates
    prediction_loss: float  # L_pred (Eq. 15), likewise


COLUMNS = tuple(field.name for field in fields(CurvePoint))


def curve_file(checkpoint: Path) -> Path:
    """Where the curve of a trained folder, or of a shipped checkpoint's stem, lies."""
    return checkpoint / CURVE if checkpoint.is_dir() else checkpoint.with_name(f"{checkpoint.name}.{CURVE}")


def curve_text(points: Iterable[CurvePoint]) -> str:
    """With a header line; read and written again it stays the same."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    for point in points:
        episode, *figures = astuple(point)
        writer.writerow([episode, *(f"{figure:.{DIGITS}g}" for figure in figures)])
    return buffer.getvalue()


def read_curve(path: Path) -> Sequence[CurvePoint] | None:
    """None where there is no such file; CheckpointError for one that is not a curve."""
    try:
        head, *rows = csv.reader(path.read_text(encoding="utf-8").splitlines())
        points = [CurvePoint(int(row[0]), *map(float, row[1:])) for row in rows]
    except FileNotFoundError:
        return None
    except (ValueError, TypeError, IndexError, OSError, csv.Error) as error:
        raise CheckpointError(f"{path}: not a learning curve ({error}); delete it, or copy it again") from None
    if tuple(head) != COLUMNS:
        raise CheckpointError(f"{path}: not a learning curve (it does not begin with {','.join(COLUMNS)}); delete it")
    return points
