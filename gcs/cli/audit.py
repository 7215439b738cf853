"""``gcs audit``: is the audit log what was written?"""

import argparse
import re
import sys
from pathlib import Path
from typing import Any

from gcs.cli.errors import complain
from gcs.config import ConfigError, load_config
from gcs.store.chain import verify_chain
from gcs.store.engine import StoreError
from gcs.store.store import using_store

PROGRAM = "gcs audit"


def add_audit_parser(commands: Any) -> None:
    """Add the subcommand; ``args.run(args)`` runs it."""
    parser = commands.add_parser("audit", help="check the audit log's hash chain", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True, dest="action")
    verify = actions.add_parser("verify", help="every event is as it was written, none is missing before the newest")
    verify.add_argument("--head", metavar="DIGEST", help="a digest that verify printed before: must still be there")
    verify.add_argument("--config", type=Path, metavar="FILE", help="the server's configuration")
    verify.add_argument("--store", metavar="URL", help="the server's store, instead of the configured one")
    verify.set_defaults(run=run_audit)


def run_audit(args: argparse.Namespace) -> int:
    """0 when the chain is whole, 1 when it is not, 2 on a mistake."""
    try:
        head = _digest(args.head)
        url = load_config(args.config).store.url if args.store is None else args.store
        with using_store(url) as store:
            report = verify_chain(store.engine, head)
    except (ConfigError, StoreError) as error:
        return complain(PROGRAM, error)
    if report.broken_id is not None:
        print(f"{PROGRAM}: event {report.broken_id} is not what was written, or one before it is gone", file=sys.stderr)
        return 1
    if not report.head_seen:
        print(f"{PROGRAM}: the digest {args.head} is not in the log: its end was cut off or rewritten", file=sys.stderr)
        return 1
    before = f", {report.unchained} older ones were never chained" if report.unchained else ""
    print(f"{report.events} events are whole{before}; newest digest {report.head}")
    return 0


def _digest(text: str | None) -> str | None:
    if text is not None and not re.fullmatch(r"[0-9a-f]{64}", text):
        raise ConfigError("--head: should be the 64 hexadecimal digits that gcs audit verify printed")
    return text
