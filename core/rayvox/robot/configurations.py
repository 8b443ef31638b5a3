"""Configurations and base poses in the kernel's form."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from rayvox.errors import InvalidInputError

FloatArray = npt.NDArray[np.float64]


def as_configurations(configurations: npt.ArrayLike | None, joints: int, count: int) -> FloatArray:
    """(n, joints) C-contiguous float64; a single one, or None for a robot without joints, is repeated `count` times.

    Raises InvalidInputError. Whether the values are finite is checked by the kernel.
    """
    if configurations is None:
        if joints:
            raise InvalidInputError(f"configurations of {joints} joint values are needed")
        return np.zeros((count, 0))
    array = _as_float64(configurations, "configurations")
    array = array[None, :] if array.ndim == 1 else array
    if array.ndim != 2 or array.shape[1] != joints:
        raise InvalidInputError(f"configurations must have shape (n, {joints}), got {array.shape}")
    if len(array) == 1:
        array = np.broadcast_to(array, (count, joints))
    if count not in (1, len(array)):
        raise InvalidInputError(f"{len(array)} configurations do not go with {count} base poses")
    return np.ascontiguousarray(array)


def as_poses(poses: npt.ArrayLike | None, name: str) -> FloatArray:
    """(n, 4, 4) C-contiguous float64; identity for None. Raises InvalidInputError for other shapes.

    Whether they are rigid is checked by the kernel.
    """
    array = np.eye(4) if poses is None else _as_float64(poses, name)
    array = array[None] if array.ndim == 2 else array
    if array.ndim != 3 or array.shape[1:] != (4, 4):
        raise InvalidInputError(f"{name} must have shape (n, 4, 4) or (4, 4), got {array.shape}")
    return np.ascontiguousarray(array)


def _as_float64(value: npt.ArrayLike, name: str) -> FloatArray:
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "fiu":
            raise TypeError(f"dtype {array.dtype}")
        return array.astype(np.float64, copy=False)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(f"{name} must be an array of numbers: {error}") from None
