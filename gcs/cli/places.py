"""``gcs places``: forget where the users of campaigns were."""

import argparse
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from gcs.cli.errors import complain
from gcs.config import ConfigError, load_config
from gcs.ports import Event
from gcs.store.engine import StoreError
from gcs.store.privacy import campaigns_to_wipe, wipe_places
from gcs.store.store import Store, using_store

PROGRAM = "gcs places"


def add_places_parser(commands: Any) -> None:
    """Add the subcommand; ``args.run(args)`` runs it."""
    parser = commands.add_parser("places", help="wipe where the users of campaigns were", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True, dest="action")
    wipe = actions.add_parser("wipe", help="irrevocably; results stay")
    which = wipe.add_mutually_exclusive_group(required=True)
    which.add_argument("--campaign", metavar="ID", help="this campaign, which must be over")
    which.add_argument("--older-than-days", type=float, metavar="N", help="every campaign that is over for so long")
    wipe.add_argument("--config", type=Path, metavar="FILE", help="the server's configuration")
    wipe.add_argument("--store", metavar="URL", help="the server's store, instead of the configured one")
    wipe.set_defaults(run=run_places)


def run_places(args: argparse.Namespace) -> int:
    """0 when done, 2 on a mistake."""
    try:
        url = load_config(args.config).store.url if args.store is None else args.store
        with using_store(url) as store:
            wanted = _wanted(store, args)
            for campaign_id in wanted:
                wipe_places(store.engine, campaign_id)
                words = "the places of its users were wiped"
                store.journal.record(Event(0.0, "privacy.wiped", words, campaign_id=campaign_id, actor="command line"))
    except (ConfigError, StoreError) as error:
        return complain(PROGRAM, error)
    print(f"wiped the users' places of {len(wanted)} campaigns")
    return 0


def _wanted(store: Store, args: argparse.Namespace) -> list[str]:
    if args.campaign is None:
        if not 0.0 <= args.older_than_days <= 36_500.0:
            raise ConfigError("--older-than-days: should be 0 to 36500")
        return list(campaigns_to_wipe(store.engine, datetime.now(UTC) - timedelta(days=args.older_than_days)))
    record = store.campaigns.get(args.campaign)
    if record is None:
        raise ConfigError(f"there is no campaign {args.campaign}")
    if not record.over:
        raise ConfigError(f"campaign {record.id} is {record.state}; it needs its users' places until it is over")
    return [record.id]
