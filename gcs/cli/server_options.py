"""Options of the command line over the server's configuration file; loads nothing of the server."""

import argparse

from gcs.config import ConfigError, ServerConfig, check_config


def with_options(config: ServerConfig, args: argparse.Namespace) -> ServerConfig:
    """Options win over the file."""
    server = {name: value for name in ("host", "port", "speedup") if (value := getattr(args, name)) is not None}
    document = config.model_dump()
    document["server"] |= server
    document["drones"] |= dict(_drone(text) for text in args.drone)
    if args.store is not None:
        document["store"]["url"] = args.store
    return check_config(document, "options")


def _drone(text: str) -> tuple[str, str]:
    system_id, equals, address = text.partition("=")
    if not equals or not address:
        raise ConfigError(f"--drone {text}: should be SYSID=ADDRESS, such as 1=udpout:127.0.0.1:14540")
    return system_id, address
