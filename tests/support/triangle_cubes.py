"""Triangles against cubes, all with all: the separating axis test of Akenine-Moller (2001) in float64."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


def gaps(triangles: FloatArray, centres: FloatArray, halves: FloatArray) -> FloatArray:
    """(t, c): largest separation of (t, 3, 3) triangles from (c,) cubes over the test's axes, negative where they
    overlap."""
    edges = np.roll(triangles, -1, axis=1) - triangles
    normal = np.cross(edges[:, 0], edges[:, 1])[:, None]
    crossed = np.cross(edges[:, :, None], np.eye(3)).reshape(-1, 9, 3)
    axes = np.concatenate([np.broadcast_to(np.eye(3), (len(triangles), 3, 3)), normal, crossed], axis=1)
    length = np.linalg.norm(axes, axis=2)
    axes = axes / np.where(length > 1e-9, length, 1.0)[:, :, None]
    along = np.einsum("tax,tkx->tak", axes, triangles)
    middle = np.einsum("tax,cx->tac", axes, centres)
    reach = np.abs(axes).sum(axis=2)[:, :, None] * halves
    apart = np.maximum(along.min(axis=2)[:, :, None] - middle, middle - along.max(axis=2)[:, :, None]) - reach
    apart[length <= 1e-9] = -np.inf
    return apart.max(axis=1)
