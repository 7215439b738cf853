"""``gcs doctor``: ports, permissions, versions, links, disk and clock of this machine, and what to do about them."""

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console

from gcs.api.settings import DASHBOARD, is_loopback
from gcs.cli.errors import complain
from gcs.cli.server_options import with_options
from gcs.config import ConfigError, ServerConfig, load_config
from gcs.doctor.finding import Finding, Grade
from gcs.doctor.fleet import LISTEN_S, check_fleet, check_policy_service
from gcs.doctor.machine import check_keys, machine
from gcs.doctor.software import software
from gcs.store.engine import StoreError
from gcs.store.store import using_store

PROGRAM = "gcs doctor"
STYLES = {Grade.OK: "green", Grade.CAUTION: "yellow", Grade.RED: "bold red"}


def add_doctor_parser(commands: Any) -> None:
    """Add the subcommand; ``args.run(args)`` runs it."""
    parser = commands.add_parser("doctor", help="is this machine fit to fly from?", description=__doc__)
    parser.add_argument("--config", type=Path, metavar="FILE", help="the server's configuration")
    parser.add_argument("--host", help="address that the server is to listen on")
    parser.add_argument("--port", type=int, help="port that the server is to listen on")
    parser.add_argument("--store", metavar="URL", help="the server's store, instead of the configured one")
    parser.add_argument("--drone", action="append", default=[], metavar="SYSID=ADDRESS", help="a vehicle to listen for")
    parser.add_argument(
        "--listen-s", type=float, default=LISTEN_S, metavar="S", help="for drones (default %(default)g)"
    )
    parser.add_argument("--json", action="store_true", help="findings as JSON, for programs")
    parser.set_defaults(run=run_doctor, speedup=None)


def run_doctor(args: argparse.Namespace) -> int:
    """0 when nothing is red, 1 when something is, 2 on a usage error."""
    try:
        config = with_options(load_config(args.config), args)
    except ConfigError as error:
        return complain(PROGRAM, error)
    if not 0.0 < args.listen_s <= 600.0:
        return complain(PROGRAM, ConfigError(f"--listen-s {args.listen_s:g}: should be more than 0, at most 600"))
    findings = []
    console = Console(highlight=False, soft_wrap=True)
    for finding in examine(config, args.listen_s):
        findings.append(finding)
        if not args.json:
            show(finding, console)
    if args.json:
        print(json.dumps([asdict(finding) for finding in findings], indent=2))
    else:
        console.print(summary(findings))
    return 1 if any(finding.grade is Grade.RED for finding in findings) else 0


def examine(config: ServerConfig, listen_s: float) -> Iterator[Finding]:
    """Every check, one after the other."""
    yield from software(DASHBOARD)
    yield from machine(config)
    yield check_keys(is_loopback(config.server.host), any_keys(config))
    yield from check_policy_service(config.policy.url)
    yield from check_fleet(config.drones, listen_s)


def any_keys(config: ServerConfig) -> bool:
    """False where there is no store yet; one that cannot be opened has its own finding."""
    url = config.store.url
    if url.startswith("sqlite:///") and not Path(url.removeprefix("sqlite:///")).exists():
        return False
    try:
        with using_store(url) as store:
            return bool(store.keys.any_active())
    except StoreError:
        return False


def show(finding: Finding, console: Console) -> None:
    """One line, and one for what to do."""
    style = STYLES[finding.grade]
    console.print(f"[{style}]{finding.grade:8}[/] ", end="")
    console.print(f"{finding.check:18} {finding.found}", markup=False)
    if finding.remedy:
        console.print(f"{'':9}{'':18} -> {finding.remedy}", markup=False)


def summary(findings: Sequence[Finding]) -> str:
    """The last line."""
    counts = {grade: sum(finding.grade is grade for finding in findings) for grade in Grade}
    verdict = "not fit to fly from: mend what is red" if counts[Grade.RED] else "fit to fly from"
    return f"{verdict} ({counts[Grade.OK]} ok, {counts[Grade.CAUTION]} caution, {counts[Grade.RED]} red)"
