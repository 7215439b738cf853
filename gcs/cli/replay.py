"""``gcs replay LOG``: a recorded campaign on the operator's page, with a time slider, at any speed."""

import argparse
import secrets
import tempfile
from contextlib import closing
from pathlib import Path
from socket import socket
from typing import Any

from gcs.api.app import create_app
from gcs.api.idle_control import IdleControl
from gcs.api.listening import ListenError, open_listener, shown_address
from gcs.api.server import serve
from gcs.api.settings import ApiSettings, is_loopback
from gcs.cli.errors import UsageError, complain
from gcs.cli.recordings import KINDS, copy_recording
from gcs.store.engine import StoreError
from gcs.store.records import CampaignRecord
from gcs.store.store import Store, using_store

PROGRAM = "gcs replay"
SHOWN = 20  # campaigns that an error message lists


def add_replay_parser(commands: Any) -> None:
    """Add the subcommand; ``args.run(args)`` runs it."""
    parser = commands.add_parser("replay", help="show a recorded campaign on the page", description=__doc__)
    parser.add_argument("log", type=Path, metavar="LOG", help=KINDS.replace("`", ""))
    parser.add_argument("--campaign", metavar="ID", help="of a store: which one (default the newest that was started)")
    parser.add_argument("--host", default="127.0.0.1", help="address of this machine to listen on (default 127.0.0.1)")
    parser.add_argument("--port", type=int, default=8080, help="port to listen on (default 8080; 0: any free one)")
    parser.set_defaults(run=run_replay)


def run_replay(args: argparse.Namespace) -> int:
    """0 after a clean end, 2 when there is nothing to show."""
    try:
        listener = _listener(args.host, args.port)
        with (
            closing(listener),
            tempfile.TemporaryDirectory(prefix="gcs-replay-", ignore_cleanup_errors=True) as folder,
            using_store(copy_recording(args.log, Path(folder))) as store,
        ):
            _show(store, chosen(store, args.campaign), listener)
    except (UsageError, StoreError, ListenError) as error:
        return complain(PROGRAM, error)
    return 0


def _listener(host: str, port: int) -> socket:
    if not is_loopback(host):
        raise UsageError(f"--host {host}: a replay shows places of people without a key, so to this machine only")
    if not 0 <= port <= 65_535:
        raise UsageError(f"--port {port}: should be 0 to 65535")
    return open_listener(host, port)


def chosen(store: Store, campaign_id: str | None) -> CampaignRecord:
    """The campaign to begin with; others of the same store can be chosen on the page."""
    known = [record for record in store.campaigns.newest(limit=500) if _was_started(store, record)]
    if not known:
        raise UsageError("LOG holds no campaign that was started")
    if campaign_id is None:
        return known[0]
    found = next((record for record in known if record.id == campaign_id), None)
    if found is None:
        others = ", ".join(f"{record.id} ({record.name})" for record in known[:SHOWN])
        raise UsageError(f"--campaign {campaign_id}: no such campaign was started in LOG; there are {others}")
    return found


def _was_started(store: Store, record: CampaignRecord) -> bool:
    """Also one that failed before its first slot: its launch is recorded."""
    return bool(store.slots.times(record.id) or store.telemetry.times(record.id))


def _show(store: Store, record: CampaignRecord, listener: socket) -> None:
    """Reading is open on loopback; the key that could change something is told to nobody."""
    app = create_app(IdleControl(), store, ApiSettings(one_time_key=secrets.token_urlsafe(24)))
    when = f"{record.created_at:%Y-%m-%d %H:%M} UTC"
    print(f"gcs: {record.name} of {when}, flown by {record.policy}: {record.state}", flush=True)
    print(f"gcs: open {shown_address(listener)}#replay={record.id} (Ctrl-C ends it)", flush=True)
    serve(app, listener)
