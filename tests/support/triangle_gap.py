"""How far triangles are apart, in extended precision and with every axis that can part degenerate ones too.

A triangle may be a segment or a point. The truth that collision queries are measured against at the extremes.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.longdouble]
_PAIRS_AT_ONCE = 20_000


def _dot(a: Real, b: Real) -> Real:
    product: Real = a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]
    return product


def _cross(a: Real, b: Real) -> Real:
    i, j = [1, 2, 0], [2, 0, 1]
    product: Real = a[:, i] * b[:, j] - a[:, j] * b[:, i]
    return product


def _axes(a: Real, b: Real) -> Iterator[Real]:
    edges_a, edges_b = np.roll(a, -1, axis=1) - a, np.roll(b, -1, axis=1) - b
    normal_a, normal_b = _cross(edges_a[:, 0], edges_a[:, 1]), _cross(edges_b[:, 0], edges_b[:, 1])
    yield from (normal_a, normal_b)
    for i in range(3):
        yield from (_cross(normal_a, edges_a[:, i]), _cross(normal_b, edges_b[:, i]))
        for j in range(3):
            yield _cross(edges_a[:, i], edges_b[:, j])
    # From an edge's line or a corner to a corner: what parts segments and points.
    for corners, others, edges in ((a, b, edges_b), (b, a, edges_a)):
        for i in range(3):
            for j in range(3):
                across, edge = corners[:, i] - others[:, j], edges[:, j]
                yield across
                squared = _dot(edge, edge)
                along = _dot(across, edge) / np.where(squared > 0, squared, 1)
                yield across - edge * along[:, None]


def triangle_gaps(a: NDArray[np.floating], b: NDArray[np.floating]) -> Real:
    """(n, 3, 3) corners twice -> (n,) largest gap along any separating axis, metres; negative where they overlap."""
    a, b = a.astype(np.longdouble), b.astype(np.longdouble)
    # The size is taken out, so that no product of four lengths leaves the range of the numbers.
    size = np.maximum(np.abs(a - a[:, :1]).max(axis=(1, 2)), np.abs(b - a[:, :1]).max(axis=(1, 2)))
    size = np.where(size > 0, size, 1)
    a, b = (a - a[:, :1]) / size[:, None, None], (b - a[:, :1]) / size[:, None, None]
    largest = np.full(len(a), -np.inf, dtype=np.longdouble)
    for axis in _axes(a, b):
        length = np.sqrt(_dot(axis, axis))
        unit = axis / np.where(length > 0, length, 1)[:, None]
        along_a, along_b = _dot(a, unit[:, None]), _dot(b, unit[:, None])
        gap = np.maximum(along_b.min(axis=1) - along_a.max(axis=1), along_a.min(axis=1) - along_b.max(axis=1))
        largest = np.where(length > 0, np.maximum(largest, gap), largest)
    return largest * size


def mesh_gap(corners_a: NDArray[np.floating], corners_b: NDArray[np.floating], pose: NDArray[np.float64]) -> float:
    """(s, 3, 3), (t, 3, 3) and a (4, 4) pose of b -> the least gap of any pair of triangles."""
    a = corners_a.astype(np.longdouble)
    rotation, translation = pose[:3, :3].astype(np.longdouble), pose[:3, 3].astype(np.longdouble)
    b = np.einsum("tij,kj->tik", corners_b.astype(np.longdouble), rotation) + translation
    low_a, high_a, low_b, high_b = a.min(axis=1), a.max(axis=1), b.min(axis=1), b.max(axis=1)
    apart = np.maximum(low_a[:, None] - high_b[None], low_b[None] - high_a[:, None]).max(axis=2)
    least = float(apart.min())
    size = max(float(high_a.max() - low_a.min()), float(high_b.max() - low_b.min()))
    # A pair's gap is at least that of its boxes; the nearest boxes are looked at, and all that might be as near.
    s, t = np.nonzero(apart <= max(least, 0.0) + 1e-3 * size)
    gaps = [
        triangle_gaps(a[s[i : i + _PAIRS_AT_ONCE]], b[t[i : i + _PAIRS_AT_ONCE]])
        for i in range(0, len(s), _PAIRS_AT_ONCE)
    ]
    return float(np.concatenate(gaps).min())
