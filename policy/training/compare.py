"""Whether learning earns its place: gcrl against the plain planner it grows from, same search, same starts.

``python -m policy.training.compare [--traces] [--checkpoint FILE] [--seeds K]`` prints a Markdown table. Campaigns
are the paper's (U = 2, 117 dB, T = 120, launch at the centre, jittered); without ``--traces`` the users are walkers
of the three presets.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from policy.agents.base import Agent
from policy.agents.gcrl import GcrlAgent, GcrlSettings
from policy.evaluation.rollout import fly, jittered
from policy.mobility.presets import REAL_SETS, WALKER_PRESETS
from policy.mobility.reader import find_trace, read_traces
from policy.mobility.traces import TraceError
from policy.mobility.walkers import generate_walkers
from policy.model.checkpoint import load_evaluator
from policy.model.checkpoint_error import CheckpointError
from policy.search.settings import SearchSettings, settings_for
from policy.training.collect import ArrayPlaces
from policy.world.arrays import FloatArray
from policy.world.scenario import Area, Scenario

SLOTS = 120
WALKERS = 60


@dataclass(frozen=True)
class Place:
    """A named campaign with its users' places [T+1, M, 2]."""

    name: str
    scenario: Scenario
    pos_enu_m: FloatArray


def real_places(only: Sequence[str] = ()) -> Iterator[Place]:
    """The real sets, found as missions find them; ``only``: their names, none for all three."""
    for real in (real for real in REAL_SETS if not only or real.file.removesuffix(".csv") in only):
        path = find_trace(real.file, None)
        traces = read_traces(path, area_size_m=real.area_size_m, num_samples=SLOTS + 1, slot_s=15.0)
        yield Place(real.file.removesuffix(".csv"), centred(real.area_size_m, traces.num_users), traces.pos_enu_m)


def walker_places(seed: int = 1) -> Iterator[Place]:
    """The three presets in the areas that they were fitted for."""
    for real in REAL_SETS:
        params = WALKER_PRESETS[real.preset]
        walkers = generate_walkers(WALKERS, SLOTS + 1, 15.0, real.area_size_m, seed, params=params)
        yield Place(real.preset, centred(real.area_size_m, WALKERS), walkers.pos_enu_m)


def centred(size_m: tuple[float, float], users: int, uavs: int = 2) -> Scenario:
    """The paper's campaign in an area of ``size_m``."""
    return Scenario(
        area=Area((0.0, 0.0), size_m),
        launch_enu_m=np.tile(0.5 * np.asarray(size_m), (uavs, 1)),
        collect_mbps=np.full(users, 0.02),
        slots=SLOTS,
    )


def variants(search: SearchSettings) -> dict[str, GcrlSettings]:
    """The plain planner, what flies, what its forecast replaced, and what flies with the learned value as well."""
    whole = GcrlSettings(search=search)
    by_rule = replace(whole, use_forecast=False)
    return {
        "plain": whole.without_network(),
        "rule": replace(by_rule, predicted_slots=0),
        "f2": by_rule,
        "gcrl": whole,
        "gcrl+value": replace(whole, use_value=True),
    }


def scores(place: Place, agent: Agent, seeds: int) -> tuple[FloatArray, float]:
    """Episodic AoI of each start [K], and the median decision in ms."""
    kappa, decision_ms = [], []
    for seed in range(seeds):
        record = fly(jittered(place.scenario, seed), ArrayPlaces(place.pos_enu_m), agent, seed)
        kappa.append(record.metrics.episodic_aoi)
        decision_ms += record.decision_ms
    return np.asarray(kappa), float(np.median(decision_ms))


def main() -> int:
    """Exit code 0, or 2 with one line on stderr."""
    parser = argparse.ArgumentParser(prog="python -m policy.training.compare", description=__doc__)
    parser.add_argument("--traces", action="store_true", help="the three real sets (UCS_DATA_DIR) instead of walkers")
    parser.add_argument("--checkpoint", type=Path, help="default: the shipped one")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--horizon", type=int, nargs="+", default=[15])
    parser.add_argument("--beam", type=int, default=20)
    parser.add_argument("--accel", type=float, default=float("inf"), help="m/s2; default: the paper's ideal motion")
    parser.add_argument("--only", nargs="+", choices=sorted(variants(SearchSettings())), help="default: all")
    arguments = parser.parse_args()
    try:
        evaluator = load_evaluator(arguments.checkpoint)
        places = list(real_places() if arguments.traces else walker_places())
    except (CheckpointError, TraceError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    _write("| users | H | policy | AoI | ± | ms |", "| --- | --- | --- | --- | --- | --- |")
    for place in places:
        flown = replace(place, scenario=place.scenario.with_accel(arguments.accel))
        for horizon in arguments.horizon:
            search = replace(settings_for(flown.scenario), horizon_slots=horizon, beam=arguments.beam)
            for name, settings in variants(search).items():
                if arguments.only is None or name in arguments.only:
                    kappa, median_ms = scores(flown, GcrlAgent(settings, evaluator), arguments.seeds)
                    row = (place.name, horizon, name, f"{kappa.mean():.3f}", f"{kappa.std():.3f}", f"{median_ms:.1f}")
                    _write("| " + " | ".join(str(cell) for cell in row) + " |")
    return 0


def _write(*lines: str) -> None:
    for line in lines:
        sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
