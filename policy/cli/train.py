"""``policy train``: trains gcrl on a mission's users, checkpoints into a folder."""

import argparse
import importlib
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from policy.cli.arguments import CommandError, number, whole
from policy.cli.display import training_bar
from policy.cli.episodes import episode_sampler
from policy.cli.stopping import stop_signals
from policy.evaluation.rollout import SlotPhysics
from policy.mission_file import load_mission, vary
from policy.world.transition import step

if TYPE_CHECKING:
    from policy.training.settings import TrainProgress


PHYSICS = ("ideal", "mock")


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """The command's arguments."""
    parser = commands.add_parser("train", help="train gcrl on a mission", description=__doc__)
    parser.add_argument("mission", metavar="MISSION.toml", help="mission file, or the name of a shipped one")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for checkpoints and logs")
    parser.add_argument("--episodes", type=whole(1, 10_000_000), default=500, metavar="N")
    parser.add_argument("--seed", type=whole(0, 2**31 - 1), default=0, metavar="S")
    parser.add_argument("--accel", type=number(0.1, 50.0), metavar="A", help="acceleration limit of the UAVs, m/s2")
    parser.add_argument("--device", default="cpu", help="cpu (default) or cuda")
    parser.add_argument(
        "--physics", choices=PHYSICS, default="ideal", help="the paper's motion (default), or the mock's vehicles"
    )
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint in DIR")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Train and say where the checkpoint is."""
    _need_torch()
    mission = vary(load_mission(options.mission), max_accel_mps2=options.accel)
    scenario, sampler = episode_sampler(mission)
    _make_folder(options.out)
    # Only now: these import torch.
    from policy.training.api import train  # noqa: PLC0415
    from policy.training.settings import TrainingError, TrainSettings  # noqa: PLC0415

    settings = TrainSettings(
        episodes=options.episodes, seed=options.seed, device=options.device, physics=options.physics
    ).shortened()
    title = f"{mission.name}: training gcrl"
    with training_bar(title, options.episodes) as show, stop_signals() as stop:

        def report(progress: "TrainProgress") -> None:
            show(progress.episode, progress.mean_score)
            _log(progress)

        try:
            path = train(
                scenario,
                sampler,
                settings,
                options.out,
                resume=options.resume,
                progress=report,
                stop=stop,
                physics=_physics(options.physics),
            )
        except TrainingError as error:
            raise CommandError(str(error)) from error
    print(f"trained {options.episodes} episodes: {path}")


def _physics(name: str) -> SlotPhysics:
    if name == "ideal":
        return step
    from policy.cli.mock_physics import MockPhysics  # noqa: PLC0415 - compiles the mock's physics

    return MockPhysics()


def _need_torch() -> None:
    try:
        importlib.import_module("torch")
    except ImportError as error:
        raise CommandError("training needs the [train] extra: pip install 'uav-crowdsensing[train]'") from error


def _make_folder(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CommandError(f"--out {path}: cannot be created: {error.strerror or error}") from error


def _log(progress: "TrainProgress", every: int = 25) -> None:
    """A line now and then where there is no terminal for the bar."""
    if sys.stderr.isatty() or (progress.episode % every and progress.episode != progress.episodes):
        return
    loss = "" if math.isnan(progress.value_loss) else f", value loss {progress.value_loss:.4g}"
    print(
        f"episode {progress.episode}/{progress.episodes}: AoI {progress.mean_score:.2f}{loss}"
        f", {progress.eta_s:.0f} s left",
        file=sys.stderr,
    )
