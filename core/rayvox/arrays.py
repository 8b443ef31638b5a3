"""Array arguments brought into the kernel's form, with errors that name what was wrong."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from rayvox.errors import InvalidInputError

FloatArray = npt.NDArray[np.float32] | npt.NDArray[np.float64]


def as_points(points: npt.ArrayLike, name: str) -> FloatArray:
    """(n, 3) C-contiguous float32 (kept) or float64 (everything else). Raises InvalidInputError for other shapes."""
    array = _as_float_array(points, name)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidInputError(f"{name} must have shape (n, 3), got {array.shape}")
    return array if array.flags.c_contiguous else array.copy(order="C")


def as_points_f64(points: npt.ArrayLike, name: str) -> npt.NDArray[np.float64]:
    """As as_points, always float64; a single (3,) becomes (1, 3)."""
    return as_points(np.atleast_2d(_as_float_array(points, name)), name).astype(np.float64, copy=False)


def as_pose(matrix: npt.ArrayLike | None, name: str) -> npt.NDArray[np.float64] | None:
    """(4, 4) C-contiguous float64, or None. Whether it is rigid is checked by the kernel."""
    if matrix is None:
        return None
    array = np.ascontiguousarray(_as_float_array(matrix, name), dtype=np.float64)
    if array.shape != (4, 4):
        raise InvalidInputError(f"{name} must have shape (4, 4), got {array.shape}")
    return array


def as_poses(matrices: npt.ArrayLike | None, name: str) -> npt.NDArray[np.float64]:
    """(n, 4, 4) C-contiguous float64; a single (4, 4) becomes (1, 4, 4), None the identity. The kernel checks them."""
    array = np.eye(4) if matrices is None else _as_float_array(matrices, name)
    if array.ndim == 2:
        array = array[np.newaxis]
    if array.ndim != 3 or array.shape[1:] != (4, 4):
        raise InvalidInputError(f"{name} must have shape (4, 4) or (n, 4, 4), got {array.shape}")
    return np.ascontiguousarray(array, dtype=np.float64)


def as_rigid(matrix: npt.ArrayLike, name: str) -> npt.NDArray[np.float64]:
    """(4, 4) float64 rigid transform. Raises InvalidInputError for anything else (tolerance 1e-5, as the kernel's)."""
    pose = as_pose(matrix, name)
    if pose is None or not np.isfinite(pose).all():
        raise InvalidInputError(f"{name} must be a finite (4, 4) matrix")
    rotation = pose[:3, :3]
    off = np.abs(rotation @ rotation.T - np.eye(3)).max()
    if off > 1e-5 or np.linalg.det(rotation) < 0 or pose[3].tolist() != [0, 0, 0, 1]:
        raise InvalidInputError(f"{name} is not rigid")
    return pose


def as_vector(vector: Sequence[float] | npt.NDArray[Any], name: str) -> tuple[float, float, float]:
    """Three finite numbers."""
    array = _as_float_array(vector, name)
    if array.shape != (3,):
        raise InvalidInputError(f"{name} must be three numbers, got shape {array.shape}")
    return float(array[0]), float(array[1]), float(array[2])


def _as_float_array(value: npt.ArrayLike, name: str) -> FloatArray:
    try:
        array = np.asarray(value)
        if array.dtype == np.float32:
            return array
        if array.dtype.kind not in "fiu":
            raise TypeError(f"dtype {array.dtype}")
        return array.astype(np.float64, copy=False)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{name} must be an array of numbers: {error}") from None
