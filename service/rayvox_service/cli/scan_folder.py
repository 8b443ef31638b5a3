"""A folder of scans with poses, as commands take it: flags, and what they name."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rayvox.scan_io import POSE_FILE_NAME, PosedFile, list_scan_files, match_poses, read_poses

from rayvox_service.cli.command_error import CommandError

FOLDER_HELP = "scans of one kind: .pcd .ply .npy .bin, or 16-bit depth .png"


def add_folder_arguments(parser: argparse.ArgumentParser, optional: bool = False) -> None:
    """The folder, its poses, and how its files are to be read."""
    parser.add_argument("folder", type=Path, nargs="?" if optional else None, help=FOLDER_HELP)
    parser.add_argument(
        "--poses", type=Path, help=f"TUM (t x y z qx qy qz qw) or KITTI (3x4) rows; default FOLDER/{POSE_FILE_NAME}"
    )
    parser.add_argument(
        "--extrinsic", type=Path, help="T_pose_sensor as one KITTI row, where poses are not the sensor's"
    )
    parser.add_argument("--bin-columns", type=int, default=4, help="floats per point of .bin: 4 is KITTI, 3 is x y z")
    parser.add_argument("--intrinsics", metavar="FX,FY,CX,CY", help="pixels; needed for depth images")
    parser.add_argument("--depth-scale", type=float, default=0.001, metavar="M", help="of depth images (%(default)s)")


def posed_files(arguments: argparse.Namespace) -> list[PosedFile]:
    """The folder's files with their poses; says how many have none. Raises CommandError, ScanFormatError."""
    files = list_scan_files(arguments.folder)
    pose_path: Path = arguments.poses or arguments.folder / POSE_FILE_NAME
    if not pose_path.is_file():
        raise CommandError(f"{pose_path}: no such pose file; name one with --poses")
    matched = match_poses(files, read_poses(pose_path))
    if len(matched) < len(files):
        print(f"{len(files) - len(matched)} of {len(files)} scans have no pose near their time and are left out")
    return matched


def extrinsic(path: Path | None) -> NDArray[np.float64]:
    """T_pose_sensor (4,4). Raises CommandError."""
    if path is None:
        return np.eye(4)
    poses = read_poses(path)
    if len(poses) != 1:
        raise CommandError(f"{path}: {len(poses)} transforms, expected one row")
    transform: NDArray[np.float64] = poses.T_map_sensor[0]
    return transform


def intrinsics(text: str | None) -> tuple[float, float, float, float] | None:
    """Four numbers in pixels. Raises CommandError."""
    if text is None:
        return None
    try:
        fx, fy, cx, cy = (float(word) for word in text.split(","))
    except ValueError:
        raise CommandError(f"--intrinsics {text}: expected four numbers FX,FY,CX,CY") from None
    return fx, fy, cx, cy
