"""Whether learning earns its place: gcrl against the plain planner it grows from, same search, same starts.

``python -m policy.training.compare [--traces] [--checkpoint FILE] [--seeds K]`` prints a Markdown table: mean, standard
error, and p of Wilcoxon's signed-rank test against the first row. Campaigns are the paper's (U = 2, 117 dB, T = 120,
launch at the centre, jittered); without ``--traces`` the users are walkers of the three presets.
"""

import argparse
import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from policy.agents.base import Agent
from policy.agents.gcrl import GcrlAgent, GcrlSettings
from policy.evaluation.paired import signed_rank_p
from policy.evaluation.rollout import fly, jittered
from policy.mobility.traces import TraceError
from policy.model.checkpoint import load_evaluator
from policy.model.checkpoint_error import CheckpointError
from policy.model.evaluator import Evaluator
from policy.search.settings import SearchSettings, settings_for
from policy.training.collect import ArrayPlaces
from policy.training.places import Place, real_names, real_place, walker_places
from policy.world.arrays import FloatArray
from policy.world.scenario import Scenario


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


@dataclass(frozen=True)
class Scores:
    """K campaigns of one method: start k is jittered by seed k, its users are drawn by it."""

    kappa: FloatArray  # [K] episodic AoI
    decision_ms: float  # median


def scores(place: Place, agent: Agent, seeds: int, share: float = 1.0) -> Scores:
    """Fly; ``share`` of the users take part, others each time."""
    kappa, decision_ms = [], []
    for seed in range(seeds):
        scenario, pos_enu_m = subset(place, share, seed)
        record = fly(jittered(scenario, seed), ArrayPlaces(pos_enu_m), agent, seed)
        kappa.append(record.metrics.episodic_aoi)
        decision_ms += record.decision_ms
    return Scores(np.asarray(kappa), float(np.median(decision_ms)))


def subset(place: Place, share: float, seed: int) -> tuple[Scenario, FloatArray]:
    """The campaign with a random ``share`` of its users (at least one)."""
    users = place.pos_enu_m.shape[1]
    taken = np.sort(np.random.default_rng(seed).permutation(users)[: max(1, round(share * users))])
    scenario = replace(place.scenario, collect_mbps=place.scenario.collect_mbps[taken])
    return scenario, place.pos_enu_m[:, taken]


def main() -> int:
    """Exit code 0, or 2 with one line on stderr."""
    arguments = _parser().parse_args()
    try:
        evaluator = load_evaluator(arguments.checkpoint, arguments.forecast)
        known = arguments.traces is not None
        half = 1 if arguments.half else None
        names = arguments.traces or real_names()
        places = [real_place(name, half) for name in names] if known else list(walker_places(arguments.crowd))
    except (CheckpointError, TraceError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    _write("| users | H | policy | AoI | ± | p | ms |", "| --- " * 7 + "|")
    for place in places:
        flown = replace(place, scenario=place.scenario.with_accel(arguments.accel))
        for horizon in arguments.horizon:
            search = settings_for(flown.scenario)
            search = replace(search, horizon_slots=horizon, beam=arguments.beam or search.beam)
            _compare(flown, search, evaluator, arguments)
    return 0


def _compare(place: Place, search: SearchSettings, evaluator: Evaluator, arguments: argparse.Namespace) -> None:
    """A row for each variant, p against the first."""
    first: FloatArray | None = None
    for name, settings in variants(search).items():
        if arguments.only is not None and name not in arguments.only:
            continue
        found = scores(place, GcrlAgent(settings, evaluator), arguments.seeds, arguments.share)
        p = "" if first is None else f"{signed_rank_p(first.tolist(), found.kappa.tolist()):.4f}"
        first = found.kappa if first is None else first
        error = found.kappa.std(ddof=1) / np.sqrt(len(found.kappa)) if len(found.kappa) > 1 else np.nan
        cells = (f"{found.kappa.mean():.3f}", f"{error:.3f}", p, f"{found.decision_ms:.1f}")
        _write("| " + " | ".join((place.name, str(search.horizon_slots), name, *cells)) + " |")
        if arguments.values is not None:
            told = {"users": place.name, "policy": name, "kappa": found.kappa.tolist()}
            with arguments.values.open("a", encoding="utf-8") as file:
                file.write(json.dumps(told) + "\n")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m policy.training.compare", description=__doc__)
    parser.add_argument("--traces", nargs="*", choices=real_names(), help="real sets (UCS_DATA_DIR); none named: all")
    parser.add_argument("--half", action="store_true", help="the half of their users that no --half trains on")
    parser.add_argument("--crowd", type=int, default=1, help="seed of the walkers")
    parser.add_argument("--checkpoint", type=Path, help="default: the shipped one")
    parser.add_argument("--forecast", type=Path, help="NAME.safetensors; default: the checkpoint's, else the shipped")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--share", type=float, default=1.0, help="of the users in each campaign, drawn by its seed")
    parser.add_argument("--horizon", type=int, nargs="+", default=[15])
    parser.add_argument("--beam", type=int, help="default: what flies")
    parser.add_argument("--accel", type=float, default=float("inf"), help="m/s2; default: the paper's ideal motion")
    parser.add_argument("--only", nargs="+", choices=sorted(variants(SearchSettings())), help="default: all")
    parser.add_argument("--values", type=Path, help="file that gets each row's campaigns, a JSON object a line")
    return parser


def _write(*lines: str) -> None:
    for line in lines:
        sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
