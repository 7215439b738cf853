"""``gcs openapi``: the API's OpenAPI document, without a running server."""

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from gcs.api.app import create_app
from gcs.api.idle_control import IdleControl
from gcs.api.schemas import ServerMessage, Subscribe
from gcs.api.settings import ApiSettings
from gcs.store.store import using_store


def add_openapi_parser(commands: Any) -> None:
    """Add the subcommand; ``args.run(args)`` runs it."""
    parser = commands.add_parser("openapi", help="print the API's OpenAPI document", description=__doc__)
    parser.set_defaults(run=run_openapi)


def run_openapi(args: argparse.Namespace) -> int:  # noqa: ARG001 - it has no options
    """0."""
    print(json.dumps(openapi_document(), indent=2))
    return 0


def openapi_document() -> dict[str, Any]:
    """As ``/openapi.json`` of a server of this version gives it, and the stream's messages, for which OpenAPI has no
    place, among the schemas.
    """
    with (
        tempfile.TemporaryDirectory(prefix="gcs-openapi-") as folder,
        using_store(f"sqlite:///{Path(folder).as_posix()}/empty.db") as store,
    ):
        document: dict[str, Any] = create_app(IdleControl(), store, ApiSettings(dashboard=Path(folder))).openapi()
    messages = TypeAdapter(ServerMessage | Subscribe).json_schema(ref_template="#/components/schemas/{model}")
    document["components"]["schemas"] |= messages["$defs"]
    return document
