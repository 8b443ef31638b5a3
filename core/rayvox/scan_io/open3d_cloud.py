"""PCD and PLY through open3d, which is imported only here and only when such a file is read."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import MissingDependencyError, ScanFormatError
from .cloud_header import DEFAULT_MAX_POINTS, HEADER_LIMIT_BYTES, check_cloud_header
from .points_file import PointsFile, measured_points


def read_cloud(path: Path, max_points: int = DEFAULT_MAX_POINTS) -> NDArray[Any]:
    """Points (n,3) float64 of a .pcd or .ply file, NaN rows included.

    Raises ScanFormatError for a file that open3d cannot read or whose header lies, MissingDependencyError without it.
    """
    return _read_cloud(path, str(path), max_points)


def decode_cloud(data: bytes, file_format: Literal["pcd", "ply"], max_points: int = DEFAULT_MAX_POINTS) -> PointsFile:
    """Points of a PCD or PLY held in memory. Raises as read_cloud."""
    # open3d reads these formats from files only.
    with tempfile.TemporaryDirectory(prefix="rayvox-") as folder:
        path = Path(folder) / f"cloud.{file_format}"
        path.write_bytes(data)
        source = f"the {file_format.upper()} body"
        return measured_points(_read_cloud(path, source, max_points), source)


def _read_cloud(path: Path, source: str, max_points: int) -> NDArray[Any]:
    with path.open("rb") as file:
        head = file.read(HEADER_LIMIT_BYTES)
    check_cloud_header(head, path.stat().st_size, path.suffix.lower(), source, max_points)
    open3d = _import_open3d()
    with open3d.utility.VerbosityContextManager(open3d.utility.VerbosityLevel.Error):
        try:
            cloud = open3d.io.read_point_cloud(str(path), remove_nan_points=False, remove_infinite_points=False)
        except RuntimeError as error:
            raise ScanFormatError(f"{source}: open3d cannot read it ({error})") from error
    points: NDArray[Any] = np.asarray(cloud.points)
    if points.size == 0:
        raise ScanFormatError(f"{source}: open3d found no points in it")
    return points


def _import_open3d() -> Any:
    try:
        import open3d
    except (ImportError, OSError) as error:
        # OSError: the wheel is there, a system library such as libGL or libgomp is not.
        raise MissingDependencyError(
            f"reading PCD and PLY needs open3d, which cannot be imported ({error}); pip install open3d"
        ) from error
    return open3d
