"""Points as they come from a file: checked, and freed of the marks that drivers leave for missing returns."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ScanFormatError


@dataclass(frozen=True, slots=True)
class PointsFile:
    """points: (n,3) float32 or float64 metres in the frame of the file. dropped: how many rows were no measurement."""

    points: NDArray[Any]
    dropped: int


def measured_points(rows: NDArray[Any], source: str | Path) -> PointsFile:
    """Keep the measurements of rows (n, >=3): drivers write a missing return as NaN, infinity or exactly (0, 0, 0).

    float64 stays only where float32 would change a value. Raises ScanFormatError where no point is left.
    """
    if rows.ndim != 2 or rows.shape[1] < 3:
        raise ScanFormatError(f"{source}: expected rows of x y z, found an array of shape {rows.shape}")
    if not (np.issubdtype(rows.dtype, np.floating) or np.issubdtype(rows.dtype, np.integer)):
        raise ScanFormatError(f"{source}: expected numbers, found an array of {rows.dtype}")
    xyz = rows[:, :3]
    measured = np.isfinite(xyz).all(axis=1) & (xyz != 0).any(axis=1)
    kept = xyz[measured]
    if kept.shape[0] == 0:
        raise ScanFormatError(f"{source}: no valid point among {rows.shape[0]}")
    with np.errstate(over="ignore"):
        narrow = kept.astype(np.float32)
    exact = kept.dtype == np.float32 or bool((narrow == kept).all())
    points = narrow if exact else kept.astype(np.float64)
    return PointsFile(np.ascontiguousarray(points), int(rows.shape[0] - kept.shape[0]))
