"""Trains networks that ship: ``python -m policy.training --out DIR``, on synthetic walkers unless told otherwise.

``--also purdue_59 ...`` mixes real sets in (leave out the one that it shall be judged on), ``--only purdue_59`` takes
one real set alone, its own model. ``--similarity`` and ``--without-rgcn`` are the networks of Tables I and III.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from policy.mobility.traces import TraceError
from policy.model.spec import SIMILARITIES, ModelSpec
from policy.training.api import train
from policy.training.places import real_names, real_place
from policy.training.samplers import WIDE_PLACES, Mixture, OwnPlace, TraceSampler
from policy.training.settings import TrainingError, TrainProgress, TrainSettings


def main() -> int:
    """Exit code 0, or 2 with one line on stderr."""
    arguments = _parser().parse_args()
    spec = ModelSpec(similarity=arguments.similarity, use_rgcn=not arguments.without_rgcn)
    try:
        settings = TrainSettings(
            episodes=arguments.episodes, seed=arguments.seed, device=arguments.device, model=spec
        ).shortened()
        sampler = _sampler(arguments.also, arguments.only)
        scenario, _ = sampler(np.random.default_rng(settings.seed))
        train(scenario, sampler, settings, arguments.out, resume=arguments.resume, progress=_tell)
    except (TrainingError, TraceError, ValueError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m policy.training", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder for the checkpoint and the logs")
    parser.add_argument("--episodes", type=int, default=TrainSettings.episodes)
    parser.add_argument("--seed", type=int, default=TrainSettings.seed)
    parser.add_argument("--device", default=TrainSettings.device, help="cpu (default) or cuda")
    parser.add_argument("--resume", action="store_true", help="go on from the folder's last checkpoint")
    parser.add_argument("--similarity", choices=SIMILARITIES, default=ModelSpec.similarity, help="of Eq. 11d")
    parser.add_argument("--without-rgcn", action="store_true", help="no messages between nodes (Table III)")
    places = parser.add_mutually_exclusive_group()
    places.add_argument("--also", nargs="+", choices=real_names(), default=(), help="real sets beside the walkers")
    places.add_argument("--only", choices=real_names(), help="one real set and no walkers")
    return parser


def _sampler(also: tuple[str, ...], only: str | None) -> TraceSampler:
    if only is not None:
        return _own(only)
    if also:
        return Mixture(WIDE_PLACES, tuple(_own(name) for name in also), ", ".join(also))
    return WIDE_PLACES


def _own(name: str) -> OwnPlace:
    place = real_place(name)
    return OwnPlace(place.scenario, place.pos_enu_m)


def _tell(told: TrainProgress) -> None:
    sys.stdout.write(
        f"{told.episode}/{told.episodes} AoI {told.score:.2f} mean {told.mean_score:.2f} "
        f"L_val {told.value_loss:.4f} L_pred {told.prediction_loss:.4f} left {told.eta_s:.0f} s\n"
    )
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
