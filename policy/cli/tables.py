"""``policy tables``: the paper's Tables I-III and Figures 3-9, measured, beside the paper's figures."""

import argparse
import os
import shlex
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from policy.agents.registry import check_name, policy_names
from policy.cli.arguments import CommandError, whole
from policy.cli.display import progress_bar
from policy.evaluation.tables import plots
from policy.evaluation.tables.campuses import Campus, find_campus
from policy.evaluation.tables.cells import fly_task
from policy.evaluation.tables.grid import SECTIONS, Extent, Grid, make_grid
from policy.evaluation.tables.methods import Absent, Method, find_models, find_rivals
from policy.evaluation.tables.paper import CAMPUSES
from policy.evaluation.tables.provenance import Provenance, machine
from policy.evaluation.tables.ray_workers import RayError, on_ray
from policy.evaluation.tables.relations import RelationsTask, make_relations, weigh_relations
from policy.evaluation.tables.report import PAGE, Findings, write_report
from policy.evaluation.tables.store import CellStore
from policy.evaluation.tables.sweep import Do, Sweep, collect, lacking, make_tasks, sweep
from policy.evaluation.tables.timing import TimingTask, make_timing, time_decisions
from policy.evaluation.tables.workers import Failed, Job, Outcome, in_processes
from policy.search.paper_tree import DEEPEST

Kept = dict[str, dict[str, Any]]
"""By campus, what one file each holds."""
NO_FILES = "demo"
"""What --quick flies where no trace is at hand."""


def add_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """The command's arguments."""
    parser = commands.add_parser("tables", help="measure the paper's tables and figures", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("runs/tables"), metavar="DIR", help="default: %(default)s")
    parser.add_argument("--quick", action="store_true", help="a small grid of short campaigns, in minutes")
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=SECTIONS, metavar="WHAT", help=_list(SECTIONS))
    parser.add_argument("--seeds", type=whole(1, 1000), metavar="K", help="campaigns a point (default: 5; quick: 2)")
    parser.add_argument(
        "--depths", nargs="+", type=whole(1, DEEPEST), metavar="N", help="of Table I (default: 2 3 4 5; quick: 2 3)"
    )
    parser.add_argument(
        "--missions", nargs="+", metavar="MISSION", help=f"files or names (default: {', '.join(CAMPUSES)})"
    )
    parser.add_argument("--policies", nargs="+", metavar="NAME", default=(), help=_list(policy_names()))
    parser.add_argument(
        "--checkpoints",
        type=Path,
        metavar="DIR",
        help="trained networks, one a subfolder: rivals by mission and seed, gcrl's beside those shipped",
    )
    parser.add_argument(
        "--workers", type=whole(1, 1024), default=os.cpu_count() or 1, metavar="N", help="processes (default: cores)"
    )
    parser.add_argument("--kept", action="store_true", help="fly nothing: a page of what DIR holds already")
    parser.add_argument("--ray", metavar="ADDRESS", help='a Ray cluster, or "local" for Ray on this machine')
    parser.set_defaults(run=run)


def run(options: argparse.Namespace) -> None:
    """Fly what is missing, write the results, say where they are."""
    for name in options.policies:
        check_name(name)
    setting = _setting(options)
    store = CellStore.create(options.out)
    tasks = make_tasks(setting.grid.points(), setting.campuses, setting.grid.extent.seeds)
    flown = _do("campaigns", tasks, store, lambda jobs: _campaigns(jobs, options), options.kept)
    relations, weighed = _relations(setting, store, options)
    timings, timed = _timings(setting, store, options)
    found = Findings(
        grid=setting.grid,
        campuses=tuple(setting.campuses.values()),
        absent=setting.absent,
        cells=collect(tasks, store),
        lacking=len(lacking(tasks, store)),
        timings=timings,
        provenance=Provenance.now(_command(), datetime.now(UTC).isoformat(timespec="seconds")),
        quick=options.quick,
        relations=relations,
    )
    write_report(options.out, found)
    _tell(options, setting, flown)
    _refuse_failures((*flown.failed, *weighed.failed, *timed.failed))


@dataclass(frozen=True)
class _Setting:
    """What is to be measured."""

    grid: Grid
    campuses: Mapping[str, Campus]
    absent: Mapping[str, Absent]


def _setting(options: argparse.Namespace) -> _Setting:
    seeds = options.seeds or (2 if options.quick else 5)
    extent = Extent.quick(seeds) if options.quick else Extent(seeds)
    if options.depths:
        extent = replace(extent, depths=tuple(dict.fromkeys(options.depths)))
    found = {name: find_campus(name, extent.slots) for name in options.missions or CAMPUSES}
    absent = {name: campus for name, campus in found.items() if isinstance(campus, Absent)}
    there = [campus for campus in found.values() if isinstance(campus, Campus)]
    if not there and options.quick:
        there = [campus for campus in [find_campus(NO_FILES, extent.slots)] if isinstance(campus, Campus)]
    if not there:
        why = "; ".join(f"{name}: {campus.reason}" for name, campus in absent.items())
        raise CommandError(f"nothing to fly: {why}; --quick or --missions demo needs no files")
    campuses = {campus.name: campus for campus in there}
    if len(campuses) < len(there):
        raise CommandError(
            f"--missions: two are named alike: {', '.join(c.name for c in there)}; change [campaign] name"
        )
    if options.checkpoints is not None and not options.checkpoints.is_dir():
        raise CommandError(f"--checkpoints {options.checkpoints}: there is no such folder")
    models = find_models(options.checkpoints)
    sections = tuple(section for section in SECTIONS if section in options.only)
    rivals = find_rivals(options.checkpoints)
    grid = make_grid(sections, tuple(campuses), extent, models, options.policies, rivals)
    return _Setting(grid, campuses, absent)


def _campaigns(jobs: Sequence[Job], options: argparse.Namespace) -> Iterable[Outcome]:
    if options.ray is None:
        return in_processes(jobs, fly_task, options.workers)
    return _ray(jobs, options)


def _ray(jobs: Sequence[Job], options: argparse.Namespace) -> Iterable[Outcome]:
    try:
        yield from on_ray(jobs, fly_task, options.ray, options.workers)
    except RayError as error:
        raise CommandError(str(error)) from error


def _relations(setting: _Setting, store: CellStore, options: argparse.Namespace) -> tuple[Kept, Sweep]:
    method = setting.grid.attending
    campuses = setting.campuses.values() if "relations" in setting.grid.sections else ()
    jobs = [make_relations(campus, method) for campus in campuses] if isinstance(method, Method) else []

    def weigh(todo: Sequence[Job]) -> Iterable[Outcome]:
        return in_processes(todo, weigh_relations, options.workers)

    done = _do("relation weights", jobs, store, weigh, options.kept)
    return _by_campus(jobs, store), done


def _by_campus(jobs: Iterable[RelationsTask | TimingTask], store: CellStore) -> Kept:
    kept = {job.campus: store.read(job.key) for job in jobs}
    return {campus: told for campus, told in kept.items() if told is not None}


def _timings(setting: _Setting, store: CellStore, options: argparse.Namespace) -> tuple[Kept, Sweep]:
    """Always in one plain process, after the campaigns: nothing may run beside it."""
    grid = setting.grid
    campuses = setting.campuses.values() if "table2" in grid.sections else ()
    jobs = [make_timing(c, _timed(grid, c.name), grid.extent.timed_slots, machine()) for c in campuses]
    done = _do("decision times", jobs, store, lambda todo: in_processes(todo, time_decisions, 1), options.kept)
    return _by_campus(jobs, store), done


def _timed(grid: Grid, campus: str) -> list[tuple[str, Method]]:
    there = [(row.name, row.on(campus)) for row in grid.methods]
    return [(name, method.for_seed(0)) for name, method in there if isinstance(method, Method)]


def _do(title: str, jobs: Sequence[Job], store: CellStore, do: Do, only_kept: bool) -> Sweep:
    """With a progress bar, or a line every tenth of the way where there is no terminal; nothing if ``only_kept``."""
    total = len(lacking(jobs, store))
    if only_kept:
        return Sweep(0, len(jobs) - total, ())
    with progress_bar(title, total) as advance:
        count = 0

        def report(_: Outcome) -> None:
            nonlocal count
            count += 1
            advance()
            if not sys.stderr.isatty() and (count == total or count % max(1, total // 10) == 0):
                print(f"{title}: {count}/{total}", file=sys.stderr)

        return sweep(jobs, store, do, report)


def _tell(options: argparse.Namespace, setting: _Setting, flown: Sweep) -> None:
    for name, absent in setting.absent.items():
        print(f"{name}: not flown, {absent.reason}", file=sys.stderr)
    if not plots.can_plot():
        print("no plots: matplotlib is not installed (pip install 'uav-crowdsensing[train]')", file=sys.stderr)
    print(f"{flown.done} campaigns flown, {flown.kept} found in {options.out}; results: {options.out / PAGE}")


def _refuse_failures(failed: Sequence[Failed]) -> None:
    if failed:
        raise CommandError(
            f"{len(failed)} measurements failed: {failed[0].reason}; the others are kept, run the command again"
        )


def _command() -> str:
    return shlex.join(["python", "-m", "policy", *sys.argv[1:]])


def _list(names: Iterable[str]) -> str:
    return f"any of: {', '.join(names)} (default: all)"
