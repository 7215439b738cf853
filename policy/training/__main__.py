"""Trains the default checkpoint that ships: ``python -m policy.training --out DIR`` (synthetic walkers only)."""

import argparse
import sys
from pathlib import Path

import numpy as np

from policy.training.api import train
from policy.training.samplers import AnyPlace
from policy.training.settings import TrainingError, TrainProgress, TrainSettings


def main() -> int:
    """Exit code 0, or 2 with one line on stderr."""
    parser = argparse.ArgumentParser(prog="python -m policy.training", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder for the checkpoint and the logs")
    parser.add_argument("--episodes", type=int, default=TrainSettings.episodes)
    parser.add_argument("--seed", type=int, default=TrainSettings.seed)
    parser.add_argument("--device", default=TrainSettings.device, help="cpu (default) or cuda")
    parser.add_argument("--resume", action="store_true", help="go on from the folder's last checkpoint")
    arguments = parser.parse_args()
    sampler = AnyPlace()
    try:
        settings = TrainSettings(episodes=arguments.episodes, seed=arguments.seed, device=arguments.device)
        scenario, _ = sampler(np.random.default_rng(settings.seed))
        train(scenario, sampler, settings, arguments.out, resume=arguments.resume, progress=_tell)
    except (TrainingError, ValueError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0


def _tell(told: TrainProgress) -> None:
    sys.stdout.write(
        f"{told.episode}/{told.episodes} AoI {told.score:.2f} mean {told.mean_score:.2f} "
        f"L_val {told.value_loss:.4f} L_pred {told.prediction_loss:.4f} left {told.eta_s:.0f} s\n"
    )
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
