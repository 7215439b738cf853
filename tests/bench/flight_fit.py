"""Draws docs/flight_fit.svg: real flight logs beside the mock's motion, and prints the figures for docs/mock.md."""

import sys
from pathlib import Path

import matplotlib as mpl

mpl.use("svg")
mpl.rcParams["svg.hashsalt"] = "flight_fit"  # the same figures give the same file
from matplotlib import pyplot as plt  # noqa: E402

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "sitl_mock"))
sys.path.insert(0, str(ROOT))

from flight_logs import DEFAULT, LEAN_45, fitted, fly, judge, read  # noqa: E402


def main() -> None:
    """Two panels a log: velocity north and east, ours over theirs."""
    figure, axes = plt.subplots(2, 1, figsize=(10, 6), sharey=True)
    for axis, name in zip(axes, (DEFAULT, LEAN_45), strict=True):
        log, (velocity, _) = read(name), fly(name)
        for column, label in ((0, "north"), (1, "east")):
            time_s = (log.time_s - log.time_s[0])[::5]
            axis.plot(time_s, log.velocity_mps[::5, column], color="0.7", lw=3, label=f"{label}, ArduCopter")
            axis.plot(time_s, velocity[::5, column], color=f"C{column}", lw=0.8, label=f"{label}, mock")
        axis.set(title=name.removesuffix(".csv.gz"), xlabel="s", ylabel="m/s")
        axis.legend(loc="upper right", ncols=2, fontsize=7)
        print(name, "as shipped", judge(name))
    for fit_on, judge_on in ((DEFAULT, LEAN_45), (LEAN_45, DEFAULT)):
        kind = fitted(fit_on)
        print(
            "held out:",
            fit_on,
            "->",
            judge_on,
            judge(judge_on, kind),
            kind.lean_frequency_radps,
            kind.vertical_gain_1ps,
        )
    figure.tight_layout()
    figure.savefig(ROOT / "docs" / "flight_fit.svg", metadata={"Date": None})


if __name__ == "__main__":
    main()
