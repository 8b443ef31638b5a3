"""16-bit depth images and the pinhole camera that took them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InvalidInputError, MissingDependencyError, ScanFormatError


@dataclass(frozen=True, slots=True)
class DepthIntrinsics:
    """Pinhole in pixels, (0, 0) being the centre of the upper left pixel; `depth_scale_m` is metres per image unit."""

    fx: float
    fy: float
    cx: float
    cy: float
    depth_scale_m: float = 0.001

    def __post_init__(self) -> None:
        values = (self.fx, self.fy, self.cx, self.cy, self.depth_scale_m)
        if not np.isfinite(values).all() or min(self.fx, self.fy, self.depth_scale_m) <= 0.0:
            raise InvalidInputError(f"intrinsics need finite values with fx, fy and depth_scale_m above 0, got {self}")


def read_depth_png(path: Path) -> NDArray[np.uint16]:
    """Depth image (rows, columns) uint16, 0 = no measurement.

    Raises ScanFormatError for anything but a 16-bit greyscale image; MissingDependencyError without Pillow.
    """
    try:
        from PIL import Image, UnidentifiedImageError
    except ImportError as error:
        raise MissingDependencyError("reading depth images needs Pillow; pip install pillow") from error
    try:
        with Image.open(path) as image:
            mode, pixels = image.mode, np.asarray(image)
    except (UnidentifiedImageError, Image.DecompressionBombError, OSError, SyntaxError, ValueError) as error:
        if isinstance(error, FileNotFoundError):
            raise
        raise ScanFormatError(f"{path}: not a readable image ({error})") from error
    # Some Pillow versions open 16-bit greyscale as 32-bit integers.
    if pixels.ndim != 2 or not mode.startswith("I") or pixels.min() < 0 or pixels.max() > np.iinfo(np.uint16).max:
        raise ScanFormatError(f"{path}: expected a 16-bit greyscale image, found mode {mode} of shape {pixels.shape}")
    return np.ascontiguousarray(pixels, dtype=np.uint16)


def depth_to_points(depth_u16: ArrayLike, intrinsics: DepthIntrinsics) -> NDArray[np.float32]:
    """Points (n,3) float32 metres, camera frame (x right, y down, z forward), of the measured pixels, row by row.

    depth_u16: (rows, columns) uint16. Raises InvalidInputError for other shapes and types.
    """
    depth = np.asarray(depth_u16)
    if depth.ndim != 2 or depth.dtype != np.uint16:
        raise InvalidInputError(f"a depth image is (rows, columns) uint16, got {depth.dtype} of shape {depth.shape}")
    rows, columns = np.nonzero(depth)
    z = depth[rows, columns].astype(np.float64) * intrinsics.depth_scale_m
    x = (columns - intrinsics.cx) / intrinsics.fx * z
    y = (rows - intrinsics.cy) / intrinsics.fy * z
    return np.column_stack([x, y, z]).astype(np.float32)
