"""Write a map of the service to a file: OctoMap's .bt or .ot, or .ply of its occupied voxels."""

from __future__ import annotations

import argparse
from pathlib import Path

from rayvox_service.cli.command_error import CommandError
from rayvox_service.cli.connection import add_connection_arguments, connect

EXPORT_SUFFIXES = (".bt", ".ot", ".ply")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Map and file."""
    parser.add_argument("map", help="the map's name")
    parser.add_argument("file", type=Path, help="where to write it; the suffix says how: .bt .ot .ply")
    add_connection_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Download and say how much it was."""
    file: Path = arguments.file
    if file.suffix.lower() not in EXPORT_SUFFIXES:
        raise CommandError(f"{file}: unknown kind of map file; known are {' '.join(EXPORT_SUFFIXES)}")
    if not file.absolute().parent.is_dir():
        raise CommandError(f"{file}: no such folder as {file.absolute().parent}")
    with connect(arguments.url, arguments.api_key) as client:
        client.download_map(arguments.map, file)
    print(f"{file}: {file.stat().st_size:,} bytes")
    return 0
