"""Where networks are compared and what they may learn from: the three real sets, and crowds fitted to them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from policy.mobility.presets import REAL_SETS, WALKER_PRESETS
from policy.mobility.reader import find_trace, read_traces
from policy.mobility.split import split_users
from policy.mobility.traces import TraceError
from policy.mobility.walkers import generate_walkers
from policy.world.arrays import FloatArray
from policy.world.scenario import Area, Scenario

SLOTS = 120
SLOT_S = 15.0
WALKERS = 60


@dataclass(frozen=True)
class Place:
    """A named campaign with its users' places [T+1, M, 2]."""

    name: str
    scenario: Scenario
    pos_enu_m: FloatArray


def real_names() -> tuple[str, ...]:
    """Of the real sets that `docs/mobility.md` tells of."""
    return tuple(real.file.removesuffix(".csv") for real in REAL_SETS)


def real_place(name: str, half: int | None = None) -> Place:
    """A real set as missions fly it. TraceError where it is not at hand.

    ``half`` 0 or 1: of its distinct users a random half, the same each time; together they are all.
    """
    real = next((real for real in REAL_SETS if real.file == f"{name}.csv"), None)
    if real is None:
        raise TraceError(f"{name}: no such real set; choose of {', '.join(real_names())}")
    path = find_trace(real.file, None)
    traces = read_traces(path, area_size_m=real.area_size_m, num_samples=SLOTS + 1, slot_s=SLOT_S)
    if half is not None:
        split = split_users(traces, test_share=0.5)
        traces = (split.train, split.test)[half]
    return Place(name, centred(real.area_size_m, traces.num_users), traces.pos_enu_m)


def walker_places(seed: int = 1) -> Iterator[Place]:
    """The three presets in the areas that they were fitted for."""
    for real in REAL_SETS:
        params = WALKER_PRESETS[real.preset]
        walkers = generate_walkers(WALKERS, SLOTS + 1, SLOT_S, real.area_size_m, seed, params=params)
        yield Place(real.preset, centred(real.area_size_m, WALKERS), walkers.pos_enu_m)


def centred(size_m: tuple[float, float], users: int, uavs: int = 2) -> Scenario:
    """The paper's campaign in an area of ``size_m``."""
    return Scenario(
        area=Area((0.0, 0.0), size_m),
        launch_enu_m=np.tile(0.5 * np.asarray(size_m), (uavs, 1)),
        collect_mbps=np.full(users, 0.02),
        slots=SLOTS,
    )
