"""Crowds fitted to the three real sets, and those sets as the fit's references."""

from dataclasses import dataclass

from policy.mobility.receiver import ReceiverParams
from policy.mobility.walkers import Pareto, WalkerParams

WALKER_PRESETS: dict[str, WalkerParams] = {
    # People in dormitories and lecture halls who hardly move: 87 % of slots without motion.
    "campus-still": WalkerParams(
        hot_spots=30,
        zipf_exponent=0.9,
        reach=(0.98, 0.95),
        hot_spot_sigma_m=21.0,
        still_share=0.2,
        commuter_share=0.04,
        commute_probability=0.1,
        return_probability=0.05,
        pause_s=Pareto(60.0, 3600.0, 0.1),
        flight_m=Pareto(5.0, 200.0, 1.5),
        ride_mps=10.0,
        ride_share=0.25,
        receiver=ReceiverParams(
            interval_samples=1,
            error_m=6.0,
            error_spread=1.0,
            jump_probability=0.15,
            jump_concentration=10.0,
            lattice_m=(8.36, 10.18),
        ),
    ),
    # A large campus that many cross, some by bus.
    "campus-wide": WalkerParams(
        hot_spots=14,
        zipf_exponent=0.5,
        reach=(0.85, 0.95),
        hot_spot_sigma_m=15.0,
        still_share=0.09,
        commuter_share=0.8,
        commute_probability=0.3,
        return_probability=0.05,
        pause_s=Pareto(16.0, 3600.0, 0.35),
        flight_m=Pareto(3.0, 330.0, 1.8),
        ride_mps=9.0,
        ride_share=0.5,
        receiver=ReceiverParams(
            interval_samples=2, error_m=1.5, error_spread=1.0, jump_probability=0.55, jump_concentration=0.2
        ),
    ),
    # Crowded around a few places, with many walks between them.
    "campus-dense": WalkerParams(
        hot_spots=4,
        zipf_exponent=1.5,
        reach=(0.65, 0.8),
        hot_spot_sigma_m=57.0,
        still_share=0.05,
        commuter_share=0.55,
        commute_probability=0.65,
        return_probability=0.15,
        pause_s=Pareto(10.0, 3600.0, 0.2),
        flight_m=Pareto(3.0, 400.0, 0.4),
        ride_mps=13.0,
        ride_share=0.4,
        receiver=ReceiverParams(
            interval_samples=2, error_m=5.5, error_spread=0.3, jump_probability=0.65, jump_concentration=0.1
        ),
    ),
}


@dataclass(frozen=True)
class RealSet:
    """A real set that a preset stands for; the files are not shipped."""

    file: str
    preset: str
    area_size_m: tuple[float, float]


REAL_SETS = (
    RealSet("purdue_59.csv", "campus-still", (1667.0, 1222.0)),
    RealSet("ncsu_33.csv", "campus-wide", (3255.49, 2718.39)),
    RealSet("kaist_92.csv", "campus-dense", (2100.21, 2174.93)),
)
