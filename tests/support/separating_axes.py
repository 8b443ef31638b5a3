"""How far triangles are apart, in plain float64: the brute force that collision queries are checked against."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def separation(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 3, 3) corners twice -> (n,) largest gap along any separating axis; negative where the triangles overlap.

    Gaps are metres: axes are of unit length, and axes of no length (parallel edges) are left out. Exact up to float64
    rounding for triangles with an area.
    """
    edges_a, edges_b = np.roll(a, -1, axis=1) - a, np.roll(b, -1, axis=1) - b
    normal_a, normal_b = np.cross(edges_a[:, 0], edges_a[:, 1]), np.cross(edges_b[:, 0], edges_b[:, 1])
    axes = [normal_a, normal_b]
    axes += [np.cross(edges_a[:, i], edges_b[:, j]) for i in range(3) for j in range(3)]
    axes += [np.cross(normal_a, edges_a[:, i]) for i in range(3)] + [
        np.cross(normal_b, edges_b[:, i]) for i in range(3)
    ]
    largest = np.full(len(a), -np.inf)
    for axis in axes:
        length = np.linalg.norm(axis, axis=1)
        usable = length > 1e-12 * (np.linalg.norm(edges_a, axis=2).max(axis=1) ** 2)
        unit = axis / np.where(usable, length, 1.0)[:, None]
        along_a, along_b = np.einsum("nij,nj->ni", a, unit), np.einsum("nij,nj->ni", b, unit)
        gap = np.maximum(along_b.min(axis=1) - along_a.max(axis=1), along_a.min(axis=1) - along_b.max(axis=1))
        largest = np.where(usable, np.maximum(largest, gap), largest)
    return largest


def mesh_separation(
    corners_a: NDArray[np.float64], corners_b: NDArray[np.float64], poses: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(s, 3, 3), (t, 3, 3), (n, 4, 4) -> (n,) the least separation of any pair of triangles at each pose."""
    least = np.empty(len(poses))
    for index, pose in enumerate(poses):
        moved = corners_b @ pose[:3, :3].T + pose[:3, 3]
        first = np.repeat(corners_a, len(moved), axis=0)
        least[index] = separation(first, np.tile(moved, (len(corners_a), 1, 1))).min()
    return least
