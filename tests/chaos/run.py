"""The long chaos test: random bad links over short campaigns of both flavours, in lock step; what `make chaos` runs."""

import argparse
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from chaos_flight import Chaos, fly
from fault_scripts import random_bad_link, write

from gcs.ports import CampaignState

FLAVOURS = ("px4", "ardupilot")


def run(total: int, seed: int) -> int:
    """Fly ``total`` campaigns; prints one line each and a table row a flavour. Exit code 1 when one was bad."""
    sums: dict[str, Counter[str]] = {flavour: Counter() for flavour in FLAVOURS}
    bad = 0
    for number in range(total):
        flavour, rng = FLAVOURS[number % 2], np.random.default_rng(seed + number)
        uavs = int(rng.integers(1, 4))
        begun_s = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            faults = write(Path(folder) / "faults.toml", random_bad_link(rng, uavs))
            flown = fly(Chaos(flavour, faults, slots=int(rng.integers(3, 9)), uavs=uavs, seed=seed + number))
        kinds = Counter(flown.kinds())
        # A launch whose orders the link ate is given up and brought home: it ends and lands, which is what counts.
        fine = flown.state in {CampaignState.DONE, CampaignState.FAILED} and flown.all_stand and not flown.breaches
        sums[flavour].update(
            campaigns=1,
            ended=flown.state in {CampaignState.DONE, CampaignState.FAILED},
            flown=flown.state is CampaignState.DONE,
            landed=flown.all_stand,
            breaches=flown.breaches,
            regained=kinds["drone.regain"],
            released=kinds["drone.release"],
        )
        bad += not fine
        print(f"{number} {flavour} {uavs} drones {flown.state} {time.monotonic() - begun_s:.0f} s", flush=True)
        if not fine:
            print(flown.story(), flush=True)
    columns = ("campaigns", "ended", "flown", "landed", "breaches", "regained", "released")
    print("| flavour | " + " | ".join(columns) + " |")
    for flavour, counts in sums.items():
        print(f"| {flavour} | " + " | ".join(str(counts[column]) for column in columns) + " |")
    return int(bad > 0)


def main() -> int:
    """Exit code 1 when a campaign did not end, a drone did not land, or anything was breached."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    return run(args.campaigns, args.seed)


if __name__ == "__main__":
    sys.exit(main())
