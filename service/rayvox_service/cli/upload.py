"""Upload a folder of scans with their poses; a repeated upload adds nothing twice."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from rayvox_service.cli.command_error import CommandError
from rayvox_service.cli.connection import add_connection_arguments, connect
from rayvox_service.cli.scan_folder import add_folder_arguments, extrinsic, intrinsics, posed_files

if TYPE_CHECKING:
    from rayvox_client import Client


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Folder, poses, and how to read the scans."""
    parser.add_argument("map", help="the map's name; it is created where it does not exist")
    add_folder_arguments(parser)
    parser.add_argument("--resolution", type=float, metavar="M", help="of a new map; default: the service's")
    parser.add_argument("--levels", type=int, help="octree levels of a new map; default: the service's")
    parser.add_argument("--max-range", type=float, metavar="M", help="longer rays are cut there and mark no end point")
    parser.add_argument("--discretize", action="store_true", help="one ray per end-point voxel (OctoMap's discretize)")
    parser.add_argument("--via", choices=("stream", "http"), default="stream", help="how to send (%(default)s)")
    parser.add_argument("--zstd", action="store_true", help="compress: for slow links")
    add_connection_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Read, send, wait until the map shows it."""
    from rayvox_service.cli.folder_scans import FolderScans

    matched = posed_files(arguments)
    scans = FolderScans(
        matched,
        extrinsic(arguments.extrinsic),
        max_range_m=arguments.max_range,
        discretize=arguments.discretize,
        bin_columns=arguments.bin_columns,
        intrinsics=intrinsics(arguments.intrinsics),
        depth_scale_m=arguments.depth_scale,
    )
    # A robot's link may drop for a while; the upload goes on after it.
    with connect(arguments.url, arguments.api_key, retries=8) as client:
        _ensure_map(client, arguments.map, arguments.resolution, arguments.levels)
        report = client.upload_sequence(
            arguments.map,
            scans,
            via=arguments.via,
            wait="applied",
            compression="zstd" if arguments.zstd else None,
        )
        revision = client.map_info(arguments.map).revision
    dropped = f"; {scans.dropped:,} rows without a measurement left out" if scans.dropped else ""
    print(f"{arguments.map}: {report}{dropped}; revision {revision}")
    return 0


def _ensure_map(client: Client, name: str, resolution_m: float | None, depth: int | None) -> None:
    from rayvox_client import NotFoundError

    try:
        existing = client.map_info(name)
    except NotFoundError:
        client.create_map(name, resolution_m=resolution_m, depth=depth, exist_ok=True)
        return
    if resolution_m is not None and resolution_m != existing.resolution_m:
        raise CommandError(f"map {name} exists with {existing.resolution_m:g} m cells, not {resolution_m:g} m")
