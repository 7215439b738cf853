"""Small statistics for the bench's table cells."""

import math
import statistics


def summary(values: list[float], scale: float = 1.0, digits: int = 1) -> str:
    """Median with the range in brackets."""
    low, high = min(values) * scale, max(values) * scale
    return f"{statistics.median(values) * scale:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def percentile(values: list[float], share: float) -> float:
    """Nearest rank."""
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, math.ceil(share * len(ordered)) - 1)]
