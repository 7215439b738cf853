"""Options of the command line over the server's configuration file; loads nothing of the server."""

import argparse
from collections.abc import Sequence

from gcs.config import ConfigError, ServerConfig, check_config


def with_options(config: ServerConfig, args: argparse.Namespace) -> ServerConfig:
    """Options win over the file."""
    server = {name: value for name in ("host", "port", "speedup") if (value := getattr(args, name)) is not None}
    document = config.model_dump()
    document["server"] |= server
    document["drones"] |= _drones(args.drone)
    if getattr(args, "tlog", None) is not None:  # the doctor records nothing
        document["link"]["tlog"] = args.tlog
    if args.store is not None:
        document["store"]["url"] = args.store
    return check_config(document, "options")


def _drones(texts: Sequence[str]) -> dict[int | str, str]:
    found: dict[int | str, str] = {}
    for text in texts:
        system_id, address = _drone(text)
        key = int(system_id) if system_id.isdecimal() else system_id
        if key in found:
            raise ConfigError(
                f"--drone {text}: drone {system_id} is given twice; two links to one drone are written "
                f"{system_id}={found[key]},{address}"
            )
        found[key] = address
    return found


def _drone(text: str) -> tuple[str, str]:
    system_id, equals, address = text.partition("=")
    if not equals or not address:
        raise ConfigError(f"--drone {text}: should be SYSID=ADDRESS, such as 1=udpout:127.0.0.1:14540")
    return system_id, address
