"""Wall time of whole campaigns over real sockets, in lock step with the mock."""

import subprocess
import sys
import time
from pathlib import Path

from measures import summary

MISSIONS = ("demo", "purdue")


def campaign_wall_times(quick: bool) -> list[tuple[str, str, str]]:
    """`gcs fly MISSION --speedup max`, process start and landing included; real traces only where they are."""
    rows = []
    for name in MISSIONS:
        times_s = []
        for _ in range(1 if quick else 3):
            begun_s = time.perf_counter()
            command = [sys.executable, "-m", "gcs", "fly", f"missions/{name}.toml", "--policy", "receding-horizon"]
            done = subprocess.run(
                [*command, "--fleet", "mock", "--speedup", "max"],
                cwd=Path(__file__).parents[2], capture_output=True, text=True, check=False,
            )  # fmt: skip
            if done.returncode != 0:
                rows.append((f"`{name}.toml`", f"not flown: {done.stderr.strip().splitlines()[-1]}", ""))
                break
            times_s.append(time.perf_counter() - begun_s)
        else:
            rows.append((f"`{name}.toml`, 2 drones", summary(times_s), "s"))
    return rows
