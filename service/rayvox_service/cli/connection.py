"""The service that a command talks to."""

from __future__ import annotations

import argparse
import os
from typing import TYPE_CHECKING

from rayvox_service.cli.command_error import CommandError

if TYPE_CHECKING:
    from rayvox_client import Client

DEFAULT_URL = "http://127.0.0.1:8080"


def add_connection_arguments(parser: argparse.ArgumentParser) -> None:
    """`--url` and `--api-key`."""
    parser.add_argument(
        "--url", default=os.environ.get("RAYVOX_URL", DEFAULT_URL), help="the service (RAYVOX_URL; default %(default)s)"
    )
    parser.add_argument("--api-key", help="its key; the variable RAYVOX_API_KEY keeps it out of the process list")


def connect(url: str, api_key: str | None = None, retries: int = 2) -> Client:
    """A client of the service at `url`. Raises CommandError where the client is not installed."""
    try:
        from rayvox_client import Client
    except ImportError as error:
        raise CommandError(f"this command needs the client ({error}); pip install rayvox-client") from error
    return Client(url, api_key or os.environ.get("RAYVOX_API_KEY") or None, retries=retries)
