"""Crowds fitted to the three real sets, and those sets as the fit's references."""

from dataclasses import dataclass

from policy.mobility.receiver import ReceiverParams
from policy.mobility.walkers import Pareto, WalkerParams

WALKER_PRESETS: dict[str, WalkerParams] = {
    # People in dormitories and lecture halls who hardly move: 87 % of slots without motion.
    "campus-still": WalkerParams(
        hot_spots=30,
        zipf_exponent=1.15,
        reach=(0.98, 0.94),
        hot_spot_sigma_m=20.0,
        still_share=0.2,
        commuter_share=0.04,
        commute_probability=0.09,
        return_probability=0.04,
        pause_s=Pareto(40.0, 3600.0, 0.14),
        flight_m=Pareto(3.5, 240.0, 1.8),
        ride_mps=12.0,
        ride_share=0.25,
        receiver=ReceiverParams(
            interval_samples=1,
            error_m=6.0,
            error_spread=1.1,
            jump_probability=0.17,
            jump_concentration=14.0,
            lattice_m=(8.36, 10.18),
        ),
    ),
    # A large campus that many cross, most by bus.
    "campus-wide": WalkerParams(
        hot_spots=8,
        zipf_exponent=0.5,
        reach=(0.89, 0.98),
        hot_spot_sigma_m=30.0,
        still_share=0.09,
        commuter_share=0.9,
        commute_probability=0.52,
        return_probability=0.01,
        pause_s=Pareto(17.5, 3600.0, 0.23),
        flight_m=Pareto(5.0, 410.0, 1.2),
        ride_mps=11.5,
        ride_share=0.75,
        receiver=ReceiverParams(
            interval_samples=2, error_m=3.5, error_spread=0.95, jump_probability=0.57, jump_concentration=0.1
        ),
    ),
    # Crowded around a few places, with many walks between them.
    "campus-dense": WalkerParams(
        hot_spots=4,
        zipf_exponent=1.8,
        reach=(0.7, 0.8),
        hot_spot_sigma_m=48.0,
        still_share=0.05,
        commuter_share=0.43,
        commute_probability=0.65,
        return_probability=0.35,
        pause_s=Pareto(10.0, 3600.0, 0.19),
        flight_m=Pareto(12.0, 620.0, 0.43),
        ride_mps=10.5,
        ride_share=0.6,
        receiver=ReceiverParams(
            interval_samples=2, error_m=5.5, error_spread=0.15, jump_probability=0.67, jump_concentration=0.07
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
