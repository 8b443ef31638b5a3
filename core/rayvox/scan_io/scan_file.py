"""One scan file of any supported kind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from ..errors import ScanFormatError
from .depth_image import DepthIntrinsics, depth_to_points, read_depth_png
from .open3d_cloud import read_cloud
from .points_file import PointsFile, measured_points
from .raw_points import KITTI_COLUMNS, read_bin, read_npy

SCAN_SUFFIXES = (".bin", ".npy", ".pcd", ".ply", ".png")


def read_points(
    path: str | Path, *, bin_columns: int = KITTI_COLUMNS, intrinsics: DepthIntrinsics | None = None
) -> PointsFile:
    """Points (n,3) in metres of a .pcd, .ply, .npy, .bin (float32, `bin_columns` per row) or 16-bit depth .png.

    A depth image needs `intrinsics`. Rows without a measurement (NaN, infinity, exactly zero) are dropped and counted.
    Raises ScanFormatError (unknown suffix, corrupt file, nothing measured), MissingDependencyError, OSError.
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix == ".png":
        if intrinsics is None:
            raise ScanFormatError(f"{file}: a depth image needs the camera's intrinsics (fx fy cx cy)")
        return measured_points(depth_to_points(read_depth_png(file), intrinsics), file)
    readers: dict[str, Callable[[Path], NDArray[Any]]] = {
        ".npy": read_npy,
        ".bin": lambda bin_file: read_bin(bin_file, bin_columns),
        ".pcd": read_cloud,
        ".ply": read_cloud,
    }
    if suffix not in readers:
        raise ScanFormatError(f"{file}: unknown kind of scan; known are {' '.join(SCAN_SUFFIXES)}")
    return measured_points(readers[suffix](file), file)
