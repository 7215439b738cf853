"""``gcs recheck``: makes a recorded campaign's decisions again and says where they come out otherwise."""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from gcs.cli.errors import complain
from gcs.config import ConfigError, load_config
from gcs.recheck.decisions import RecheckError, as_document, recheck
from gcs.store.engine import StoreError
from gcs.store.reading import EventFilter
from gcs.store.records import CampaignRecord
from gcs.store.store import Store, using_store
from policy.agents.registry import PolicyChoice
from policy.mission_file import MissionError, parse_mission
from policy.model.checkpoint_error import CheckpointError

PROGRAM = "gcs recheck"
ERRORS = (ConfigError, StoreError, MissionError, RecheckError, CheckpointError, OSError, ValueError)
SHOWN = 20  # differences on the terminal; --json has all


def add_recheck_parser(commands: Any) -> None:
    """Add the subcommand; ``args.run(args)`` runs it."""
    parser = commands.add_parser(
        "recheck", help="make a recorded campaign's decisions again and compare", description=__doc__
    )
    parser.add_argument("campaign", nargs="?", metavar="ID", help="left out: the newest campaign that was flown")
    parser.add_argument("--config", type=Path, metavar="FILE", help="the server's configuration")
    parser.add_argument("--store", metavar="URL", help="the server's store, instead of the configured one")
    parser.add_argument("--policy", metavar="NAME", help="another method than the one that flew")
    parser.add_argument("--checkpoint", metavar="FILE", help="other weights than those that flew")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every difference here")
    parser.set_defaults(run=run_recheck)


def run_recheck(args: argparse.Namespace) -> int:
    """0: bit for bit the same; 1: something differs; 2: cannot be checked."""
    try:
        url = load_config(args.config).store.url if args.store is None else args.store
        with using_store(url) as store:
            return _recheck(store, args)
    except ERRORS as error:
        return complain(PROGRAM, error)


def _recheck(store: Store, args: argparse.Namespace) -> int:
    record = _campaign(store, args.campaign)
    directory = None if record.directory is None else Path(record.directory)
    mission = parse_mission(record.document, origin=f"campaign {record.id}", directory=directory)
    own = args.policy is None or args.policy == record.policy
    checkpoint = args.checkpoint or (mission.checkpoint if own else None)
    choice = PolicyChoice(args.policy or record.policy, checkpoint)
    decisions = store.checkpoints.decisions(record.id)
    result = recheck(mission.scenario, store.slots.of(record.id), decisions, choice.build)
    if args.json is not None:
        args.json.write_text(json.dumps(as_document(result), indent=2) + "\n", encoding="utf-8")
    print(f"campaign {record.id}: {result.decisions} decisions of {record.policy}{_recorded_with(store, record.id)}")
    for one in result.differences[:SHOWN]:
        print(one.words())
    if result.differences:
        more = len(result.differences) - SHOWN
        print(f"and {more} more (--json FILE has all)" if more > 0 else "these are all", file=sys.stderr)
        print(f"{choice.name} differs in {len(result.slots)} of {result.decisions} decisions")
        return 1
    print(f"{choice.name} decides bit for bit the same")
    return 0


def _campaign(store: Store, campaign_id: str | None) -> CampaignRecord:
    if campaign_id is not None:
        record = store.campaigns.get(campaign_id)
        if record is None:
            raise RecheckError(f"there is no campaign {campaign_id} in this store")
        return record
    flown = (record for record in store.campaigns.newest() if store.slots.progress(record.id)[0] > 0)
    newest = next(flown, None)
    if newest is None:
        raise RecheckError("no campaign was flown in this store")
    return newest


def _recorded_with(store: Store, campaign_id: str) -> str:
    """Version and weights, as the log says them."""
    begun = store.events.find(EventFilter(campaign_id=campaign_id, kind="policy.begun"))
    told = dict.fromkeys((event.data.get("version", ""), event.data.get("weights_sha256", "")[:12]) for event in begun)
    words = [f"version {version}" + (f", weights {digest}" if digest else "") for version, digest in told if version]
    return f" (recorded by {'; '.join(words)})" if words else ""
