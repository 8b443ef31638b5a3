"""Checks of what the caller hands in, made before anything is sent; messages name the index and the value."""

from __future__ import annotations

import math
import uuid
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rayvox_client.errors import InvalidInputError

ROTATION_TOLERANCE = 1e-5  # the service's own


def points_array(value: ArrayLike, name: str, allow_empty: bool = False) -> NDArray[Any]:
    """(n,3) finite, C-contiguous float32 or float64, copied only where the input is something else.

    Raises:
        InvalidInputError: another shape, no rows, not numbers, or a row that is not finite.
    """
    array = _numbers(value, name)
    if array.ndim != 2 or array.shape[1] != 3:
        raise InvalidInputError(f"{name} must have shape (n, 3), got {array.shape}")
    if not allow_empty and array.shape[0] == 0:
        raise InvalidInputError(f"{name} is empty: shape (0, 3)")
    refuse_not_finite(array, name)
    return array


def configuration_rows(value: ArrayLike, name: str) -> NDArray[Any]:
    """(n,j) finite; a single (j,) becomes (1,j). InvalidInputError otherwise."""
    array = _numbers(value, name)
    array = array[None, :] if array.ndim == 1 else array
    if array.ndim != 2:
        raise InvalidInputError(f"{name} must have shape (n, j), got {array.shape}")
    refuse_not_finite(array, name)
    return array


def base_poses(value: ArrayLike, name: str) -> NDArray[np.float64]:
    """(n,4,4) finite float64; a single (4,4) becomes (1,4,4). That they are rigid is the service's to check."""
    array = _numbers(value, name).astype(np.float64)
    array = array[None] if array.ndim == 2 else array
    if array.ndim != 3 or array.shape[1:] != (4, 4):
        raise InvalidInputError(f"{name} must have shape (n, 4, 4), got {array.shape}")
    refuse_not_finite(array.reshape(-1, 16), name)
    return array


def _numbers(value: ArrayLike, name: str) -> NDArray[Any]:
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise InvalidInputError(f"{name} is not an array: {error}") from error
    if array.dtype.kind not in "fiu" and array.size:
        raise InvalidInputError(f"{name} must hold real numbers, got dtype {array.dtype}")
    target = np.float32 if array.dtype in (np.float16, np.float32) else np.float64
    return np.ascontiguousarray(array, dtype=target)


def refuse_not_finite(array: NDArray[Any], name: str) -> None:
    """Raise InvalidInputError naming the first row of an (n,3) array that holds NaN or infinity."""
    flat = array.reshape(-1)
    # A finite sum of squares proves it without an array of flags; huge values overflow it and take the long way. Not
    # by np.dot: a BLAS may take threads for it, which keep a processor busy long after (OpenBLAS: 0.1 s).
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(np.einsum("i,i->", flat, flat)):
            return
    finite = np.isfinite(array)
    if finite.all():
        return
    bad_rows = np.flatnonzero(~finite.all(axis=1))
    first = int(bad_rows[0])
    raise InvalidInputError(
        f"{name}[{first}] = {array[first].tolist()} is not finite ({bad_rows.size} of {len(array)} rows); "
        f"drop such rows, or give beams without return as no_return"
    )


def rigid_transform(value: ArrayLike | None, name: str) -> NDArray[np.float64]:
    """(4,4) float64 rigid transform, None meaning identity.

    Raises:
        InvalidInputError: another shape, not finite, last row not 0 0 0 1, rotation not orthonormal or mirrored.
    """
    if value is None:
        return np.eye(4)
    matrix = _numbers(value, name).astype(np.float64)
    if matrix.shape != (4, 4):
        raise InvalidInputError(f"{name} must have shape (4, 4), got {matrix.shape}")
    # Sixteen numbers: plain Python is faster than numpy here, ten times when the code is not in the caches.
    rows: list[list[float]] = matrix.tolist()
    for row, column in product(range(4), range(4)):
        if not math.isfinite(rows[row][column]):
            raise InvalidInputError(f"{name}[{row}, {column}] = {rows[row][column]} is not finite")
    if rows[3] != [0.0, 0.0, 0.0, 1.0]:
        raise InvalidInputError(f"{name}[3] = {rows[3]}, the last row of a rigid transform is [0, 0, 0, 1]")
    x, y, z = (row[:3] for row in rows[:3])
    deviation = max(abs(_dot(x, x) - 1), abs(_dot(y, y) - 1), abs(_dot(z, z) - 1))
    deviation = max(deviation, abs(_dot(x, y)), abs(_dot(y, z)), abs(_dot(z, x)))
    if deviation > ROTATION_TOLERANCE:
        raise InvalidInputError(
            f"{name} is not rigid: its rotation times its transpose is {deviation:.3g} off the identity "
            f"(allowed {ROTATION_TOLERANCE:g}); scale or shear is not a pose"
        )
    if _dot(x, _cross(y, z)) < 0:
        raise InvalidInputError(f"{name} is not rigid: its rotation mirrors (determinant -1)")
    return matrix


def _dot(a: list[float], b: list[float]) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: list[float], b: list[float]) -> list[float]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def vector3(value: ArrayLike, name: str) -> list[float]:
    """Three finite numbers; InvalidInputError otherwise."""
    if isinstance(value, tuple) and len(value) == 3 and all(type(x) is float and math.isfinite(x) for x in value):
        return list(value)  # most often so, and much faster than numpy
    array = _numbers(value, name)
    if array.shape != (3,):
        raise InvalidInputError(f"{name} must hold three numbers, got shape {array.shape}")
    refuse_not_finite(array.reshape(1, 3), name)
    return [float(x) for x in array]


def box_corners(lo: ArrayLike, hi: ArrayLike) -> tuple[NDArray[Any], NDArray[Any]]:
    """Lower and upper corners, (n,3) each with lo <= hi; InvalidInputError names the first box that has not."""
    lower, upper = points_array(lo, "lo"), points_array(hi, "hi")
    if lower.shape != upper.shape:
        raise InvalidInputError(f"lo has shape {lower.shape} and hi {upper.shape}: one row per box in both")
    inverted = np.flatnonzero((lower > upper).any(axis=1))
    if inverted.size:
        i = int(inverted[0])
        raise InvalidInputError(f"box {i}: lo[{i}] = {lower[i].tolist()} is above hi[{i}] = {upper[i].tolist()}")
    return lower, upper


def positive_number(value: float | None, name: str) -> float | None:
    """A finite number above zero, or None; InvalidInputError otherwise."""
    if value is None:
        return None
    if not isinstance(value, int | float | np.floating | np.integer) or not math.isfinite(value) or value <= 0:
        raise InvalidInputError(f"{name} = {value!r} is not a finite number above zero")
    return float(value)


def scan_id_text(value: str | uuid.UUID | None) -> str:
    """The canonical text of a UUID, a fresh one for None; InvalidInputError for anything else."""
    if value is None:
        return str(uuid.uuid4())
    try:
        return str(uuid.UUID(str(value)))
    except ValueError:
        raise InvalidInputError(f"scan_id = {value!r} is not a UUID") from None


def map_name(value: str) -> str:
    """As path_name, of a map."""
    return path_name(value, "map")


def path_name(value: str, what: str) -> str:
    """A name that can stand in a URL path; which names are allowed is the service's to say."""
    if not isinstance(value, str) or value in ("", ".", "..") or not value.isprintable() or "/" in value:
        raise InvalidInputError(f"{what} name {value!r} is not usable: printable text without '/' is needed")
    return value
