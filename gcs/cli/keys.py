"""``gcs keys``: API keys in the server's store."""

import argparse
from pathlib import Path
from typing import Any

from gcs.cli.errors import complain
from gcs.config import ConfigError, ServerConfig, load_config
from gcs.ports import Event
from gcs.store.engine import StoreError
from gcs.store.keys import Role
from gcs.store.store import Store, using_store

PROGRAM = "gcs keys"
MAX_NAME = 64


def add_keys_parser(commands: Any) -> None:
    """Add the subcommand; ``args.run(args)`` runs it."""
    parser = commands.add_parser("keys", help="API keys: add, list, revoke", description=__doc__)
    actions = parser.add_subparsers(metavar="ACTION", required=True, dest="action")
    add = actions.add_parser("add", help="make a key and show it, once")
    add.add_argument("--role", required=True, choices=[role.value for role in Role])
    add.add_argument("--name", required=True, help="who has it; stands in the audit log")
    actions.add_parser("list", help="show all keys, without their secrets")
    revoke = actions.add_parser("revoke", help="end a key")
    revoke.add_argument("id", help="the key's id, as list shows it")
    for action in actions.choices.values():
        action.add_argument("--config", type=Path, metavar="FILE", help="the server's configuration")
        action.add_argument("--store", metavar="URL", help="the server's store, instead of the configured one")
        action.set_defaults(run=run_keys)


def run_keys(args: argparse.Namespace) -> int:
    """0 when done, 2 on a mistake."""
    try:
        with using_store(_store_url(load_config(args.config), args)) as store:
            _act(store, args)
    except (ConfigError, StoreError) as error:
        return complain(PROGRAM, error)
    return 0


def _store_url(config: ServerConfig, args: argparse.Namespace) -> str:
    url: str = config.store.url if args.store is None else args.store
    return url


def _act(store: Store, args: argparse.Namespace) -> None:
    match args.action:
        case "add":
            _add(store, args.name, Role(args.role))
        case "list":
            for key in store.keys.all():
                ended = f"revoked {key.revoked_at:%Y-%m-%d}" if key.revoked_at else "active"
                print(f"{key.id}  {key.role:8}  {key.name}  made {key.created_at:%Y-%m-%d}  {ended}")
        case "revoke":
            if not store.keys.revoke(args.id):
                raise ConfigError(f"there is no active key {args.id}; gcs keys list shows them")
            _note(store, "keys.revoked", f"key {args.id} revoked on the command line")


def _add(store: Store, name: str, role: Role) -> None:
    if not name.strip() or len(name) > MAX_NAME or not name.isprintable():
        raise ConfigError(f"--name: should be 1 to {MAX_NAME} printable characters")
    record, text = store.keys.add(name, role)
    _note(store, "keys.added", f'{role} key {record.id} for "{name}" made on the command line')
    print(text)


def _note(store: Store, kind: str, message: str) -> None:
    store.journal.record(Event(0.0, kind, message, actor="command line"))
