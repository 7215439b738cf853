"""``policy evaluate``: scores a policy on a mission."""

import argparse
import sys
from pathlib import Path

from policy.agents.registry import policy_names
from policy.cli.arguments import number, whole
from policy.cli.display import print_result, progress_bar
from policy.evaluation.evaluate import Evaluation, evaluate, policy_of
from policy.evaluation.files import check_destination
from policy.evaluation.results import write_result
from policy.evaluation.trajectory import campaign_rows, write_trajectory
from policy.mission_file import Mission, load_mission, vary


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """The command's arguments."""
    parser = commands.add_parser("evaluate", help="score a policy on a mission", description=__doc__)
    parser.add_argument("mission", metavar="MISSION.toml", help="mission file, or the name of a shipped one")
    parser.add_argument("--policy", metavar="NAME", help=f"{', '.join(policy_names())} (default: the mission's)")
    parser.add_argument("--checkpoint", metavar="FILE", help="trained weights for a learned policy")
    parser.add_argument("--uavs", type=whole(1, 250), metavar="U", help="another number of UAVs")
    parser.add_argument("--mcl-db", type=number(1.0, 300.0), metavar="X", help="another maximum coupling loss")
    parser.add_argument("--slots", type=whole(1, 10_000), metavar="T", help="another number of slots")
    parser.add_argument(
        "--accel", type=number(0.1, 50.0), metavar="A", help="acceleration limit in m/s2 (default: the mission's)"
    )
    parser.add_argument(
        "--seeds",
        type=whole(1, 1000),
        default=1,
        metavar="K",
        help="campaigns: seed 0 from the launch point, others near",
    )
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the result object")
    parser.add_argument(
        "--trajectory", type=Path, metavar="FILE", help="write seed 0's trajectory; seed k goes to FILE's name-seedk"
    )
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Evaluate, write the files asked for, print the table."""
    for path in (options.json, options.trajectory):
        if path is not None:
            check_destination(path)
    mission = _mission(options)
    for warning in mission.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    policy = policy_of(mission, options.policy, options.checkpoint)
    total = options.seeds * mission.scenario.slots
    with progress_bar(f"{mission.name}: {policy.name}", total) as advance:
        evaluation = evaluate(mission, policy, seeds=options.seeds, on_slot=advance)
    _write(options, evaluation)
    print_result(evaluation.result)


def _mission(options: argparse.Namespace) -> Mission:
    return vary(
        load_mission(options.mission),
        uavs=options.uavs,
        mcl_db=options.mcl_db,
        max_accel_mps2=options.accel,
        slots=options.slots,
    )


def _write(options: argparse.Namespace, evaluation: Evaluation) -> None:
    if options.trajectory is not None:
        for seed, record in enumerate(evaluation.records):
            write_trajectory(seed_path(options.trajectory, seed), campaign_rows(record, evaluation.user_ids))
    if options.json is not None:
        write_result(options.json, evaluation.result)


def seed_path(path: Path, seed: int) -> Path:
    """``run.csv`` for seed 0, ``run-seed3.csv`` for seed 3."""
    return path if seed == 0 else path.with_name(f"{path.stem}-seed{seed}{path.suffix}")
