"""How long jobs of known length take on so many cores, and the tables that say so."""

import heapq
from collections.abc import Iterable, Mapping, Sequence

CORES = (1, 16, 256)


def wall_s(jobs_s: Iterable[float], cores: int) -> float:
    """Until the last of the jobs ends: each goes, in this order, to the core that is free first."""
    free_at_s = [0.0] * cores
    for seconds in jobs_s:
        heapq.heapreplace(free_at_s, free_at_s[0] + seconds)
    return max(free_at_s)


def estimate(stages: Mapping[str, Sequence[float]]) -> list[tuple[str, str, str]]:
    """A row for each number of cores; a stage begins when all of the one before it is done."""
    total_s = sum(sum(jobs_s) for jobs_s in stages.values())
    rows = []
    for cores in CORES:
        walls_s = {name: wall_s(jobs_s, cores) for name, jobs_s in stages.items()}
        whole_s = sum(walls_s.values())
        parts = ", ".join(f"{name} {length(seconds)}" for name, seconds in walls_s.items())
        rows.append((str(cores), f"{length(whole_s)} ({parts})", f"{100.0 * total_s / whole_s / cores:.0f} %"))
    return rows


def length(seconds: float) -> str:
    """As a reader would say it."""
    for unit_s, unit in ((3600.0, "h"), (60.0, "min")):
        if seconds >= unit_s:
            return f"{seconds / unit_s:.1f} {unit}"
    return f"{seconds:.0f} s"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"
