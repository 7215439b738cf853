"""``gcs fly``: one campaign, headless, over real MAVLink sockets."""

import argparse
import datetime as dt
import importlib
import re
import shlex
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from gcs.bootstrap import Cast, make_loop, make_order, make_preparer
from gcs.cli.beside_flight import comparison
from gcs.cli.errors import UsageError, complain
from gcs.cli.flight_log import FlightLog
from gcs.cli.flight_results import FlownCampaign, print_table, random_beside, trajectory_rows, write_report
from gcs.cli.mock_fleet import MockOptions, mock_fleet
from gcs.cli.preflight import preflight
from gcs.clock import ClockError, LockstepClock, RealClock
from gcs.collector import leave_what_is_loaded
from gcs.flight_loop import FlightLoop
from gcs.links.fleet_link import WiredFleetLink
from gcs.links.opening import LIBRARIES, open_link
from gcs.links.tlog import TlogRecorder
from gcs.mission.manager import Refused
from gcs.mission.order import CampaignOrder
from gcs.mission.states import FINAL
from gcs.ports import CampaignState, FlightClock, FlightSnapshot, OperatorRequest, RequestKind, VehicleStatus
from policy.evaluation.evaluate import policy_of
from policy.evaluation.files import check_destination
from policy.evaluation.results import write_result
from policy.evaluation.trajectory import write_trajectory
from policy.mission_file import Mission, load_mission

if TYPE_CHECKING:
    from gcs.cli.page_beside import Page

PROGRAM = "gcs fly"
GROUND_AMSL_M = 186.0  # of the mock's pads; any value flies, heights are above home


def add_fly_parser(commands: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Options of ``gcs fly``."""
    fly = commands.add_parser("fly", prog=PROGRAM, help="fly one campaign", description=__doc__)
    add = fly.add_argument
    add("mission", metavar="MISSION.toml", help="campaign file, or the name of one that ships")
    add("--fleet", choices=["mock"], help="fly mock drones, started for this flight (default without --drone)")
    add("--flavour", choices=["px4", "ardupilot"], default="px4", help="of the mock drones (default px4)")
    add("--wind-ms", metavar="SPEED,FROM_DEG", help="steady wind for the mock drones")
    add(
        "--drone",
        action="append",
        default=[],
        metavar="SYSID=ADDRESS",
        help="fly a real drone; once for each, several links with commas between",
    )
    add("--policy", metavar="NAME", help="instead of the mission's")
    add("--checkpoint", metavar="FILE", help="weights of a learned policy")
    add("--policy-url", metavar="URL", help="ask this `policy serve` instead of a policy of this process")
    add("--seed", type=int, default=0, help="of a policy that draws lots (default 0)")
    add("--speedup", type=_speedup, default=1.0, metavar="X|max", help="simulated seconds a second (default 1)")
    add("--report", type=Path, metavar="DIR", help="write a report page with its data")
    add("--json", type=Path, metavar="FILE", help="write the result object")
    add("--trajectory", type=Path, metavar="FILE", help="write where everyone was after each slot (CSV)")
    add("--tlog", type=Path, metavar="DIR", help="record every link (.tlog, opens in QGroundControl and MAVProxy)")
    add("--link", choices=LIBRARIES, default="pymavlink", help="MAVLink library (default pymavlink)")
    add("--signing-key", type=Path, metavar="FILE", help="64 hex digits: sign all, believe nothing unsigned")
    add("--serve", nargs="?", const="127.0.0.1:8080", metavar="HOST:PORT", help="show the flight on a page meanwhile")
    add("--keep", action="store_true", help="with --serve: leave the page up after the flight")
    fly.set_defaults(run=run_fly)


def run_fly(args: argparse.Namespace) -> int:
    """Exit code 0: flown to the end; 1: ended early; 2: could not begin."""
    try:
        return _fly(args)
    except (
        ValueError,
        ClockError,
        OSError,
    ) as error:  # MissionError, OutputError, UnknownPolicyError ... are ValueErrors
        return complain(PROGRAM, error)
    except KeyboardInterrupt:
        print(f"{PROGRAM}: ended by Ctrl-C; drones in the air are left to their own failsafes", file=sys.stderr)
        return 1


@dataclass(frozen=True)
class _Fleet:
    clock: FlightClock
    link: WiredFleetLink


def _fly(args: argparse.Namespace) -> int:
    mission = load_mission(args.mission)
    policy = policy_of(mission, args.policy, args.checkpoint)
    for path in (args.json, args.trajectory):
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            check_destination(path)
    agent = policy.build() if args.policy_url is None else None
    drones = _drones(args, mission)
    order = make_order(mission, Cast(tuple(drones), policy, agent, args.policy_url, args.seed))
    if args.keep and args.serve is None:
        raise UsageError("--keep leaves a page up and needs --serve")
    with ExitStack() as stack:
        page = _page(args, stack, tuple(drones))
        fleet = stack.enter_context(_fleet(args, mission, drones))
        progress = stack.enter_context(_progress(Console(stderr=True)))
        log = FlightLog(tell=lambda line: progress.console.print(line, highlight=False, markup=False))
        prepare = None
        if page is not None:
            log.also = (page.store.journal,)
            prepare = make_preparer(tuple(drones), policy_url=args.policy_url)
        loop = make_loop(fleet.clock, fleet.link, log, prepare)
        if not fleet.clock.is_virtual:
            leave_what_is_loaded()
        if page is not None:
            stack.enter_context(page.showing(loop, replace(mission, policy=policy.name), order.campaign_id))
            key = f"operator key {page.settings.one_time_key}"
            progress.console.print(f"page: {page.address}  {key}", highlight=False, markup=False, soft_wrap=True)
        begun, begun_s = dt.datetime.now(dt.UTC), time.monotonic()
        last = _run(loop, order, progress, log.tell)
        assert last.campaign is not None
        flown = FlownCampaign(
            mission=mission,
            policy=policy,
            scenario=order.scenario,
            seed=order.seed,
            state=last.campaign.state,
            reason=last.campaign.reason,
            records=tuple(log.slots),
            events=tuple(log.events),
            violations=loop.violations(),
            wall_s=time.monotonic() - begun_s,
            begun_utc=begun.isoformat(timespec="seconds"),
            telemetry=tuple(log.telemetry),
            decisions=tuple(log.decisions),
            repeat=_repeat(args),
        )
        progress.stop()
        code = _conclude(args, flown, last.vehicles)
        if page is not None and args.keep:
            _keep(loop, args, page.address)
    return code


def _page(args: argparse.Namespace, stack: ExitStack, seats: tuple[int, ...]) -> "Page | None":
    """The server's modules are loaded only for a flight that shows itself."""
    if args.serve is None:
        return None
    module = importlib.import_module("gcs.cli.page_beside")
    page: Page = stack.enter_context(module.open_page(args.serve, seats))
    return page


def _keep(loop: FlightLoop, args: argparse.Namespace, address: str) -> None:
    """The page and its drones stay until Ctrl-C; further campaigns may be started there."""
    print(f"the page stays up at {address}; Ctrl-C ends it", flush=True)
    try:
        if args.speedup is None:
            threading.Event().wait()  # as fast as possible would keep a core busy for nothing
        loop.run()
    except KeyboardInterrupt:
        return


def _run(loop: FlightLoop, order: CampaignOrder, progress: Progress, tell: Callable[[str], None]) -> FlightSnapshot:
    """Fly to the end; Ctrl-C brings everyone down first."""
    bar = progress.add_task("launching", total=order.scenario.slots)
    preflight(loop, order, tell)
    try:
        loop.start(order, "gcs fly")
    except Refused as refusal:  # somebody pressed the stop on the page, or started another campaign there
        raise UsageError(str(refusal)) from refusal
    show = _bar(progress, bar)
    try:
        loop.run(until=show)
    except KeyboardInterrupt:
        progress.console.print("aborting: the drones return and land (Ctrl-C again to leave them to themselves)")
        loop.submit(OperatorRequest(RequestKind.ABORT, "Ctrl-C"))
        loop.run(until=show)
    return loop.snapshot()


def _bar(progress: Progress, bar: TaskID) -> Callable[[FlightSnapshot], bool]:
    shown: list[tuple[str, int]] = [("", -1)]

    def show(snapshot: FlightSnapshot) -> bool:
        campaign = snapshot.campaign
        if campaign is None:
            return False  # begun, and not told before the store beside the page has it
        if shown[0] != (campaign.state, campaign.slot):
            shown[0] = (campaign.state, campaign.slot)
            progress.update(bar, completed=campaign.slot, description=str(campaign.state))
        return campaign.state in FINAL

    return show


def _repeat(args: argparse.Namespace) -> str:
    """The command on the report's own mission file, which names the policy; outputs are left out."""
    words = ["python", "-m", "gcs", "fly", "mission.toml", "--seed", str(args.seed)]
    words += [part for drone in args.drone for part in ("--drone", drone)]
    words += [] if args.drone else ["--fleet", "mock", "--flavour", args.flavour]
    words += ["--wind-ms", args.wind_ms] if args.wind_ms else []
    words += ["--policy-url", args.policy_url] if args.policy_url else []
    words += [] if args.drone else ["--speedup", "max" if args.speedup is None else f"{args.speedup:g}"]
    return shlex.join(words)


def _conclude(args: argparse.Namespace, flown: FlownCampaign, vehicles: Sequence[VehicleStatus]) -> int:
    console, metrics = Console(), flown.metrics
    if metrics is not None:
        if args.json is not None:
            write_result(args.json, flown.result(metrics))
        if args.trajectory is not None:
            write_trajectory(args.trajectory, trajectory_rows(flown.records))
        random = random_beside(flown)
        print_table(flown, metrics, random, console)
        if args.report is not None:
            beside = comparison(flown, vehicles)
            console.print(f"report: {write_report(flown, beside, args.report)}", soft_wrap=True)
    if flown.state is CampaignState.DONE:
        return 0
    print_reason = f"the campaign is {flown.state} after {flown.records[-1].slot if flown.records else 0} slots"
    Console(stderr=True).print(
        f"{PROGRAM}: {print_reason}: {flown.reason}", highlight=False, markup=False, soft_wrap=True
    )
    return 1


def _drones(args: argparse.Namespace, mission: Mission) -> dict[int, str | None]:
    """System id -> address, in the order of the mission's UAVs; the mock's addresses come later."""
    wanted = mission.scenario.num_uavs
    if not args.drone:
        return dict.fromkeys(range(1, wanted + 1))
    if args.fleet:
        raise UsageError("--fleet mock and --drone exclude each other; give one of them")
    if args.speedup is None:
        raise UsageError("--speedup max needs --fleet mock; real drones fly in real time")
    drones: dict[int, str | None] = {}
    for system_id, address in map(_drone, args.drone):
        if system_id in drones:
            both = f"{system_id}={drones[system_id]},{address}"
            raise UsageError(f"--drone {system_id} is given twice; two links to one drone are written {both}")
        drones[system_id] = address
    if len(drones) != wanted:
        raise UsageError(f"mission {mission.name!r} needs {wanted} drones; {len(drones)} given with --drone")
    return drones


@contextmanager
def _fleet(args: argparse.Namespace, mission: Mission, drones: Mapping[int, str | None]) -> Iterator[_Fleet]:
    addresses = {system_id: address for system_id, address in drones.items() if address is not None}
    with ExitStack() as stack:
        if not addresses:
            yield _mock_fleet(args, mission, stack)
            return
        clock, recorder = RealClock(args.speedup), _recorder(args, stack)
        link = open_link(addresses, args.link, signing_key=args.signing_key, recorder=recorder, clock=clock.now_s)
        stack.callback(link.close)
        yield _Fleet(clock, link)


def _recorder(args: argparse.Namespace, stack: ExitStack) -> TlogRecorder | None:
    """A flight clock begins at its own zero; the log says when that was."""
    return stack.enter_context(TlogRecorder(args.tlog, time.time())) if args.tlog is not None else None


def _mock_fleet(args: argparse.Namespace, mission: Mission, stack: ExitStack) -> _Fleet:
    scenario = mission.scenario
    east_m, north_m = (float(v) for v in scenario.launch_enu_m[0])
    lat_deg, lon_deg = scenario.area.frame.to_geodetic_deg(east_m, north_m)
    extra = ("--wind-ms", args.wind_ms) if args.wind_ms else ()
    home = (lat_deg, lon_deg, GROUND_AMSL_M)
    mock = stack.enter_context(mock_fleet(MockOptions(scenario.num_uavs, home, args.flavour, extra)))
    if args.link != "pymavlink":
        raise UsageError("mock drones fly in lock step, which needs --link pymavlink; give real ones with --drone")
    link = open_link({i: address for address, i in mock.drones.items()}, recorder=_recorder(args, stack))
    stack.callback(link.close)
    clock = LockstepClock(mock.clock, args.speedup)
    stack.callback(clock.close)
    return _Fleet(clock, link)


def _drone(text: str) -> tuple[int, str]:
    found = re.fullmatch(r"(\d{1,3})=(\S+)", text)
    if found is None or not 1 <= int(found[1]) <= 250:
        raise UsageError(f"--drone {text!r} is not SYSID=ADDRESS, e.g. 1=udpout:127.0.0.1:14550")
    return int(found[1]), found[2]


def _speedup(text: str) -> float | None:
    """A factor, or None for as fast as the machine can."""
    if text == "max":
        return None
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value <= 1000.0:
        raise argparse.ArgumentTypeError(f"{text!r} is neither max nor a number from 0 to 1000")
    return value


@contextmanager
def _progress(console: Console) -> Iterator[Progress]:
    columns = (TextColumn("{task.description:>11}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        yield progress
