"""Scans as bare arrays: .npy, and .bin files of raw little-endian float32."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ScanFormatError

KITTI_COLUMNS = 4


def read_npy(path: Path) -> NDArray[Any]:
    """Array of a .npy file, (n, >=3); pickled objects are refused. Raises ScanFormatError."""
    try:
        array = np.load(path, allow_pickle=False)
    except (ValueError, EOFError) as error:
        raise ScanFormatError(f"{path}: not a readable .npy array ({error})") from error
    if not isinstance(array, np.ndarray):
        raise ScanFormatError(f"{path}: an .npz archive, expected one .npy array")
    return array


def read_bin(path: Path, columns: int = KITTI_COLUMNS) -> NDArray[np.float32]:
    """Rows (n, columns) float32 of a raw file: 4 columns are KITTI's x y z intensity, 3 are x y z.

    The file does not say which; its size only rules one out. Raises ScanFormatError where the size does not fit.
    """
    if columns < 3:
        raise ScanFormatError(f"a .bin file needs at least the 3 columns x y z, not {columns}")
    size = path.stat().st_size
    row_bytes = 4 * columns
    if size == 0 or size % row_bytes != 0:
        hint = " (it would fit 3 columns: x y z)" if columns != 3 and size and size % 12 == 0 else ""
        raise ScanFormatError(f"{path}: {size} bytes are not rows of {columns} float32{hint}")
    return np.fromfile(path, dtype="<f4").reshape(-1, columns)
