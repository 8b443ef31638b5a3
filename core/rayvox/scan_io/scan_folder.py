"""A folder of scan files and the pose of each."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import ScanFormatError
from .pose_file import PoseFile
from .scan_file import SCAN_SUFFIXES


@dataclass(frozen=True, slots=True)
class PosedFile:
    """A scan file with its pose (4,4) float64 and, where known, its time."""

    path: Path
    T_map_sensor: NDArray[np.float64]
    stamp_s: float | None


def list_scan_files(folder: str | Path) -> list[Path]:
    """Scan files of one kind in `folder`, 2 before 10. Raises ScanFormatError for none, or for kinds mixed."""
    directory = Path(folder)
    if not directory.is_dir():
        raise ScanFormatError(f"{directory}: no such folder")
    files = [file for file in directory.iterdir() if file.is_file() and file.suffix.lower() in SCAN_SUFFIXES]
    kinds = sorted({file.suffix.lower() for file in files})
    if not files:
        raise ScanFormatError(f"{directory}: no scans in it; known kinds are {' '.join(SCAN_SUFFIXES)}")
    if len(kinds) > 1:
        raise ScanFormatError(f"{directory}: scans of several kinds ({' '.join(kinds)}); one folder, one kind")
    return sorted(files, key=_natural_order)


def match_poses(files: list[Path], poses: PoseFile, tolerance_s: float = 0.05) -> list[PosedFile]:
    """Give each scan its pose: in order where there are as many poses as scans, else by time.

    By time: each file's name is its time in seconds and takes the nearest stamp of a TUM file within `tolerance_s`;
    scans without such a pose are left out. Raises ScanFormatError where neither rule applies or no scan finds a pose.
    """
    stamps = poses.stamps_s
    if len(files) == len(poses):
        times = [None] * len(files) if stamps is None else [float(stamp) for stamp in stamps]
        return [PosedFile(*row) for row in zip(files, poses.T_map_sensor, times, strict=True)]
    mismatch = f"{len(files)} scans but {len(poses)} poses"
    if stamps is None:
        raise ScanFormatError(f"{mismatch}: a pose file without times needs one row per scan, in the files' order")
    try:
        names_s = [float(file.stem) for file in files]
    except ValueError as error:
        raise ScanFormatError(f"{mismatch}, and the scans' names are not times to match them by ({error})") from error
    matched: list[PosedFile] = []
    for file, stamp_s in zip(files, names_s, strict=True):
        nearest = int(np.argmin(np.abs(stamps - stamp_s)))
        if abs(stamps[nearest] - stamp_s) <= tolerance_s:
            matched.append(PosedFile(file, poses.T_map_sensor[nearest], stamp_s))
    if not matched:
        raise ScanFormatError(f"{mismatch}, and no scan's name is within {tolerance_s} s of a pose's time")
    return matched


def _natural_order(file: Path) -> list[tuple[bool, int, str]]:
    parts = re.split(r"(\d+)", file.name)
    return [(part.isdigit(), int(part) if part.isdigit() else 0, part) for part in parts]
