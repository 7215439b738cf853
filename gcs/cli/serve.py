"""``gcs serve``: REST, WebSocket and page in the main thread, the flight loop in its own.

The flight comes first: after a crash drones wait for it, and it needs half of what the web side takes to load.
"""

import argparse
import secrets
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

from gcs.api.idle_control import IdleControl
from gcs.api.listening import ListenError, Tls, open_listener, shown_address
from gcs.api.live_users import LiveCampaigns
from gcs.api.settings import ApiSettings, MapTiles, is_loopback
from gcs.bootstrap import make_loop, make_preparer
from gcs.cli.errors import complain
from gcs.cli.restart import Restart, close
from gcs.cli.server_options import with_options
from gcs.clock import RealClock
from gcs.collector import leave_what_is_loaded
from gcs.config import ConfigError, ServerConfig, load_config
from gcs.links.opening import open_link
from gcs.links.tlog import TlogRecorder
from gcs.links.transport import LinkError
from gcs.ports import FlightControl
from gcs.right_of_way import RightOfWay
from gcs.store.engine import StoreError
from gcs.store.housekeeper import Housekeeper
from gcs.store.store import Store, using_store

PROGRAM = "gcs serve"
ERRORS = (ConfigError, StoreError, ListenError, LinkError)


def add_serve_parser(commands: Any) -> None:
    """Add the subcommand; ``args.run(args)`` runs it."""
    parser = commands.add_parser("serve", help="the server: REST, WebSocket, operator page", description=__doc__)
    parser.add_argument("--config", type=Path, metavar="FILE", help="TOML; see docs/api.md")
    parser.add_argument("--host", help="address to listen on (default 127.0.0.1; others need API keys)")
    parser.add_argument("--port", type=int, help="port to listen on (default 8080)")
    parser.add_argument("--store", metavar="URL", help="sqlite:///FILE or postgresql://USER@HOST/NAME")
    parser.add_argument(
        "--drone", action="append", default=[], metavar="SYSID=ADDRESS", help="a vehicle, such as 1=udpout:HOST:PORT"
    )
    parser.add_argument("--tlog", type=Path, metavar="DIR", help="record every link (.tlog)")
    parser.add_argument("--speedup", type=float, metavar="X", help="flight seconds a second, for simulated drones only")
    parser.set_defaults(run=run_serve)


def run_serve(args: argparse.Namespace) -> int:
    """0 after a clean end, 2 when it cannot start."""
    try:
        config = with_options(load_config(args.config), args)
        with using_store(config.store.url) as store:
            _serve(config, store)
    except ERRORS as error:
        return complain(PROGRAM, error)
    return 0


def _serve(config: ServerConfig, store: Store) -> None:
    settings, tls = api_settings(config, store), _tls(config)
    live = LiveCampaigns(timedelta(seconds=config.users.away_after_s))
    with (
        closing(open_listener(config.server.host, config.server.port)) as listener,
        closing(Housekeeper(store, config.users.keep_places_days)),
        _flight(config, store, live) as flight,
    ):
        from gcs.api.app import create_app  # noqa: PLC0415 - loads while the drones fly already
        from gcs.api.server import serve  # noqa: PLC0415

        app = create_app(flight, store, settings, live)
        leave_what_is_loaded()
        print(f"gcs: open {shown_address(listener, encrypted=tls is not None)}", flush=True)
        if settings.one_time_key is not None:
            print(f"gcs: operator key until this server ends: {settings.one_time_key}", flush=True)
        serve(app, listener, tls)
        _warn_of_drones_in_the_air(flight)


def _tls(config: ServerConfig) -> Tls | None:
    """Checked; off loopback without it, who starts the server is told what that means."""
    section = config.tls
    if section.certificate is not None and section.key is not None:
        tls = Tls(Path(section.certificate), Path(section.key))
        tls.check()
        return tls
    if not is_loopback(config.server.host):
        words = "without TLS keys and places can be read on the way: set [tls], or put a proxy with TLS in front"
        print(f"gcs: {words}", file=sys.stderr, flush=True)
    return None


def api_settings(config: ServerConfig, store: Store) -> ApiSettings:
    """Strangers get nothing: off loopback there must be keys; on loopback without any, one is made for this run."""
    settings = ApiSettings(
        host=config.server.host,
        seats=tuple(config.drones),
        max_body_bytes=config.server.max_body_kb * 1024,
        rate_per_s=config.server.rate_per_s,
        max_streams=config.server.max_streams,
        map_tiles=MapTiles(config.map.tiles, config.map.pmtiles, config.map.attribution),
    )
    if store.keys.any_active():
        return settings
    if not is_loopback(config.server.host):
        raise ConfigError(
            f"no API keys, and {config.server.host} is not loopback: make one with "
            "python -m gcs keys add --role admin --name NAME, or listen on 127.0.0.1"
        )
    return replace(settings, one_time_key=secrets.token_urlsafe(24))


@contextmanager
def _flight(config: ServerConfig, store: Store, live: LiveCampaigns) -> Iterator[FlightControl]:
    """The flight loop in its thread; without drones there is nothing to fly."""
    if not config.drones:
        print("gcs: no drones are configured; records can be looked at", flush=True)
        for record in store.campaigns.unfinished():
            close(store, record, f"the server ended while it was {record.state}; started again without drones")
        yield IdleControl()
        return
    prepare = make_preparer(tuple(config.drones), policy_url=config.policy.url, live=live.enrol)
    clock = RealClock(config.server.speedup)
    recorder = None if config.link.tlog is None else TlogRecorder(config.link.tlog, time.time())
    key = config.link.signing_key
    link = open_link(config.drones, config.link.library, signing_key=key, recorder=recorder, clock=clock.now_s)
    link.flush(clock.now_s())  # a heartbeat: vehicles answer where they hear us, while the rules are being loaded
    loop = make_loop(RightOfWay(clock), link, store.journal, prepare)
    Restart(store, loop, clock, prepare, config.server.speedup, live.bring_back).run()
    leave_what_is_loaded()
    thread = threading.Thread(target=loop.run, name="flight", daemon=True)
    thread.start()
    try:
        yield loop
    finally:
        loop.stop()
        thread.join(5.0)
        link.close()
        if recorder is not None:
            recorder.close()


def _warn_of_drones_in_the_air(flight: FlightControl) -> None:
    """Ending the server brings no drone down: their own failsafes act when the setpoints stop."""
    armed = [str(vehicle.system_id) for vehicle in flight.snapshot().vehicles if vehicle.armed]
    if armed:
        print(f"gcs: drones {', '.join(armed)} are still armed; their own failsafes act now", file=sys.stderr)
