"""How far beside its reference a slot ends: the mock's M600s on slots of random velocities, led by guidance.

Each drone of the batch is told 10 times a second what ``gcs.guidance`` would tell it over MAVLink; no sockets, no loss.
Prints the table of docs/operations.md.
"""

import math

import numpy as np

from gcs.guidance.reference import slot_references
from gcs.guidance.tracking import DEFAULT_GAINS, follow
from gcs.ports import UavTrack
from policy.world.arrays import FloatArray
from sitl_mock.batch import BatchFleet
from sitl_mock.physics.fleet import TICK_S, Air
from sitl_mock.physics.vehicle import M600

SHARES, WINDS_MPS = (0.90, 0.92, 0.95, 1.00), (0.0, 5.0, 8.0)
DRONES, SLOTS, SLOT_S, SEED = 24, 40, 15.0, 3
WIND_FROM_DEG, ALT_M, TOP_MPS = 70.0, 120.0, 18.0
GUIDANCE_TICKS = round(0.1 / TICK_S)


def misses_m(share: float, wind_mps: float) -> FloatArray:
    """Distances at all slots' ends [DRONES x SLOTS]: the reference turns by ``share`` of the vehicle's acceleration."""
    toward_rad = math.radians(WIND_FROM_DEG + 180.0)
    fleet = BatchFleet(1, DRONES, air=Air((wind_mps * math.cos(toward_rad), wind_mps * math.sin(toward_rad))))
    rng, missed = np.random.default_rng(SEED), []
    for slot in range(SLOTS):
        heading_rad, speed_mps = rng.uniform(0.0, 2.0 * math.pi, DRONES), rng.uniform(10.0, TOP_MPS, DRONES)
        command = np.stack((speed_mps * np.sin(heading_rad), speed_mps * np.cos(heading_rad)), axis=-1)
        references = slot_references(
            fleet.pos_ned_m[0, :, 1::-1],
            fleet.vel_ned_mps[0, :, 1::-1],
            command,
            max_accel_mps2=share * M600.max_accel_mps2,
            slot_s=SLOT_S,
            start_s=slot * SLOT_S,
        )
        for tick in range(round(SLOT_S / (GUIDANCE_TICKS * TICK_S))):
            now_s = slot * SLOT_S + tick * GUIDANCE_TICKS * TICK_S
            told = [
                follow(track, path, ALT_M, now_s, max_speed_mps=TOP_MPS, gains=DEFAULT_GAINS).vel_ned_mps
                for track, path in zip(_tracks(fleet, now_s), references, strict=True)
            ]
            fleet.step(np.array([told]), GUIDANCE_TICKS)
        ends = [path.at((slot + 1) * SLOT_S) for path in references]
        wanted = np.array([(end.east_m, end.north_m) for end in ends])
        missed.append(np.linalg.norm(fleet.pos_ned_m[0, :, 1::-1] - wanted, axis=-1))
    return np.concatenate(missed)


def _tracks(fleet: BatchFleet, now_s: float) -> list[UavTrack]:
    rows = zip(fleet.pos_ned_m[0].tolist(), fleet.vel_ned_mps[0].tolist(), strict=True)
    return [
        UavTrack(number + 1, pos[1], pos[0], -pos[2], vel[1], vel[0], 0.0, 0.0, now_s)
        for number, (pos, vel) in enumerate(rows)
    ]


def main() -> None:
    """Print the table."""
    print("| share of the limit | " + " | ".join(f"{wind:g} m/s of wind" for wind in WINDS_MPS) + " |")
    print("| --- " * (1 + len(WINDS_MPS)) + "|")
    for share in SHARES:
        cells = []
        for wind_mps in WINDS_MPS:
            off_m = misses_m(share, wind_mps)
            cells.append(f"{off_m.mean():.1f} / {np.percentile(off_m, 99):.1f} / {off_m.max():.1f}")
        print(f"| {share:.2f} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
