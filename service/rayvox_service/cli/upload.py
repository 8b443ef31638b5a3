"""Upload a folder of scans with their poses; a repeated upload adds nothing twice."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from rayvox.scan_io import POSE_FILE_NAME, list_scan_files, match_poses, read_poses

from rayvox_service.cli.command_error import CommandError
from rayvox_service.cli.connection import add_connection_arguments, connect

if TYPE_CHECKING:
    from rayvox_client import Client

DEFAULT_RESOLUTION_M = 0.05


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Folder, poses, and how to read the scans."""
    parser.add_argument("map", help="the map's name; it is created where it does not exist")
    parser.add_argument("folder", type=Path, help="scans of one kind: .pcd .ply .npy .bin, or 16-bit depth .png")
    parser.add_argument(
        "--poses", type=Path, help=f"TUM (t x y z qx qy qz qw) or KITTI (3x4) rows; default FOLDER/{POSE_FILE_NAME}"
    )
    parser.add_argument(
        "--extrinsic", type=Path, help="T_pose_sensor as one KITTI row, where poses are not the sensor's"
    )
    parser.add_argument("--resolution", type=float, metavar="M", help=f"of a new map; default {DEFAULT_RESOLUTION_M}")
    parser.add_argument("--levels", type=int, default=16, help="octree levels of a new map (default %(default)s)")
    parser.add_argument("--max-range", type=float, metavar="M", help="longer rays are cut there and mark no end point")
    parser.add_argument("--discretize", action="store_true", help="one ray per end-point voxel (OctoMap's discretize)")
    parser.add_argument("--bin-columns", type=int, default=4, help="floats per point of .bin: 4 is KITTI, 3 is x y z")
    parser.add_argument("--intrinsics", metavar="FX,FY,CX,CY", help="pixels; needed for depth images")
    parser.add_argument("--depth-scale", type=float, default=0.001, metavar="M", help="of depth images (%(default)s)")
    parser.add_argument("--via", choices=("stream", "http"), default="stream", help="how to send (%(default)s)")
    parser.add_argument("--zstd", action="store_true", help="compress: for slow links")
    add_connection_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Read, send, wait until the map shows it."""
    from rayvox_service.cli.folder_scans import FolderScans

    files = list_scan_files(arguments.folder)
    pose_path: Path = arguments.poses or arguments.folder / POSE_FILE_NAME
    if not pose_path.is_file():
        raise CommandError(f"{pose_path}: no such pose file; name one with --poses")
    matched = match_poses(files, read_poses(pose_path))
    if len(matched) < len(files):
        print(f"{len(files) - len(matched)} of {len(files)} scans have no pose near their time and are left out")
    scans = FolderScans(
        matched,
        _extrinsic(arguments.extrinsic),
        max_range_m=arguments.max_range,
        discretize=arguments.discretize,
        bin_columns=arguments.bin_columns,
        intrinsics=_intrinsics(arguments.intrinsics),
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


def _ensure_map(client: Client, name: str, resolution_m: float | None, depth: int) -> None:
    from rayvox_client import NotFoundError

    try:
        existing = client.map_info(name)
    except NotFoundError:
        client.create_map(name, resolution_m=resolution_m or DEFAULT_RESOLUTION_M, depth=depth, exist_ok=True)
        return
    if resolution_m is not None and resolution_m != existing.resolution_m:
        raise CommandError(f"map {name} exists with {existing.resolution_m:g} m cells, not {resolution_m:g} m")


def _extrinsic(path: Path | None) -> NDArray[np.float64]:
    if path is None:
        return np.eye(4)
    poses = read_poses(path)
    if len(poses) != 1:
        raise CommandError(f"{path}: {len(poses)} transforms, expected one row")
    transform: NDArray[np.float64] = poses.T_map_sensor[0]
    return transform


def _intrinsics(text: str | None) -> tuple[float, float, float, float] | None:
    if text is None:
        return None
    try:
        fx, fy, cx, cy = (float(word) for word in text.split(","))
    except ValueError:
        raise CommandError(f"--intrinsics {text}: expected four numbers FX,FY,CX,CY") from None
    return fx, fy, cx, cy
