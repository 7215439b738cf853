"""``policy train``: trains a method that learns on a mission's users, checkpoints into a folder."""

import argparse
import importlib
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from policy.agents.registry import LEARNED, RIVALS, agent_type, check_name
from policy.cli.arguments import CommandError, number, whole
from policy.cli.changes import changed
from policy.cli.display import training_bar
from policy.cli.episodes import Sampler, episode_sampler
from policy.cli.stopping import stop_signals
from policy.evaluation.rollout import SlotPhysics
from policy.mission_file import Mission, load_mission, vary
from policy.world.scenario import Scenario
from policy.world.transition import step

if TYPE_CHECKING:
    from policy.training.rival_settings import RivalProgress
    from policy.training.settings import TrainProgress

EPISODES = {"gcrl": 500, **dict.fromkeys(RIVALS, 2000)}
"""By default: the paper's for gcrl, which asks much of each; four times that for each rival."""

PHYSICS = ("ideal", "mock")

OPTIONS = ("episodes", "seed")
"""Numbers of gcrl's settings that have an option of their own."""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """The command's arguments."""
    parser = commands.add_parser("train", help="train a method on a mission", description=__doc__)
    parser.add_argument("mission", metavar="MISSION.toml", help="mission file, or the name of a shipped one")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for checkpoints and logs")
    parser.add_argument(
        "--policy", default="gcrl", metavar="NAME", help=f"{', '.join(sorted(LEARNED))} (default: %(default)s)"
    )
    parser.add_argument(
        "--episodes", type=whole(1, 10_000_000), metavar="N", help="campaigns flown (default: gcrl 500, others 2000)"
    )
    parser.add_argument("--seed", type=whole(0, 2**31 - 1), default=0, metavar="S")
    parser.add_argument("--accel", type=number(0.1, 50.0), metavar="A", help="acceleration limit of the UAVs, m/s2")
    parser.add_argument("--device", default="cpu", metavar="NAME", help="of the networks: cpu or cuda (default: cpu)")
    parser.add_argument(
        "--physics", choices=PHYSICS, default="ideal", help="gcrl: the paper's motion (default), or the mock's vehicles"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        dest="changes",
        metavar="NAME=VALUE",
        help="another value of a number in the method's settings, such as n_step=3; may be given several times",
    )
    parser.add_argument("--resume", action="store_true", help="go on from the last checkpoint in DIR")
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Train and say where the checkpoint is."""
    _check_policy(options.policy)
    if options.policy in RIVALS and options.physics != "ideal":
        raise CommandError(f"--physics {options.physics}: only gcrl trains on it; leave it out for {options.policy}")
    _need_torch(options.device)
    mission = vary(load_mission(options.mission), max_accel_mps2=options.accel)
    scenario, sampler = episode_sampler(mission)
    _make_folder(options.out)
    episodes = options.episodes or EPISODES[options.policy]
    # Only now: these import torch.
    from policy.training.settings import TrainingError  # noqa: PLC0415

    with training_bar(f"{mission.name}: training {options.policy}", episodes) as show:
        try:
            if options.policy in RIVALS:
                _train_rival(options, mission, sampler, episodes, show)
            else:
                _train_gcrl(options, scenario, sampler, episodes, show)
        except TrainingError as error:
            raise CommandError(str(error)) from error
    print(f"trained {episodes} episodes: {options.out}")


def _train_gcrl(
    options: argparse.Namespace, scenario: Scenario, sampler: Sampler, episodes: int, show: Callable[[int, float], None]
) -> None:
    from policy.training.api import train  # noqa: PLC0415
    from policy.training.settings import TrainSettings  # noqa: PLC0415

    def report(progress: "TrainProgress") -> None:
        show(progress.episode, progress.mean_score)
        _log(progress)

    usual = TrainSettings(episodes=episodes, seed=options.seed, device=options.device, physics=options.physics)
    settings = changed(usual.shortened(), options.changes, keep=OPTIONS)
    with stop_signals() as stop:
        train(
            scenario,
            sampler,
            settings,
            options.out,
            resume=options.resume,
            progress=report,
            stop=stop,
            physics=_physics(options.physics),
        )


def _physics(name: str) -> SlotPhysics:
    if name == "ideal":
        return step
    from policy.cli.mock_physics import MockPhysics  # noqa: PLC0415 - compiles the mock's physics

    return MockPhysics()


def _train_rival(
    options: argparse.Namespace, mission: Mission, sampler: Sampler, episodes: int, show: Callable[[int, float], None]
) -> None:
    import torch  # noqa: PLC0415

    from policy.training.rival_settings import RivalTraining  # noqa: PLC0415
    from policy.training.rivals import train_rival  # noqa: PLC0415

    def report(progress: "RivalProgress") -> None:
        show(progress.episode, progress.score)
        _log_rival(progress)

    torch.manual_seed(options.seed)
    kind = agent_type(options.policy).learner_type
    learner = kind(changed(kind.settings_type(), options.changes), options.device)
    settings = RivalTraining(episodes=episodes, seed=options.seed, mission=mission.name, device=options.device)
    train_rival(learner, sampler, settings, options.out, resume=options.resume, progress=report)


def _check_policy(name: str) -> None:
    check_name(name)
    if name not in LEARNED:
        raise CommandError(f"--policy {name}: does not learn; choose one of: {', '.join(sorted(LEARNED))}")


def _need_torch(device: str) -> None:
    try:
        torch = importlib.import_module("torch")
    except ImportError as error:
        raise CommandError("training needs the [train] extra: pip install 'uav-crowdsensing[train]'") from error
    try:
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:
        line = " ".join(str(error).split())[:120]
        raise CommandError(f"--device {device}: cannot be used here ({line}); leave it out for cpu") from error


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


def _log_rival(progress: "RivalProgress", every: int = 250) -> None:
    """The same for a rival, whose campaigns come in batches."""
    fresh = progress.episode // every != (progress.episode - progress.batch) // every
    if sys.stderr.isatty() or not (fresh or progress.episode >= progress.episodes):
        return
    tested = "" if math.isnan(progress.tested) else f", tested {progress.tested:.2f} (best {progress.best:.2f})"
    print(
        f"episode {progress.episode}/{progress.episodes}: AoI {progress.score:.2f}{tested}"
        f", {progress.eta_s:.0f} s left",
        file=sys.stderr,
    )
