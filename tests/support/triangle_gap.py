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


def triangle_gaps(a: NDArray[np.floating], b: NDArray[np.floating], precision: type = np.longdouble) -> Real:
    """(n, 3, 3) corners twice -> (n,) largest gap along any separating axis, metres; negative where they overlap.

    precision: of everything after the corners' differences.
    """
    a, b = a.astype(np.longdouble), b.astype(np.longdouble)
    # The size is taken out, so that no product of four lengths leaves the range of the numbers.
    size = np.maximum(np.abs(a - a[:, :1]).max(axis=(1, 2)), np.abs(b - a[:, :1]).max(axis=(1, 2)))
    size = np.where(size > 0, size, 1)
    a, b = ((p - a[:, :1]) / size[:, None, None] for p in (a, b))
    a, b = a.astype(precision), b.astype(precision)
    largest = np.full(len(a), -np.inf, dtype=precision)
    for axis in _axes(a, b):
        length = np.sqrt(_dot(axis, axis))
        unit = axis / np.where(length > 0, length, 1)[:, None]
        along_a, along_b = _dot(a, unit[:, None]), _dot(b, unit[:, None])
        gap = np.maximum(along_b.min(axis=1) - along_a.max(axis=1), along_a.min(axis=1) - along_b.max(axis=1))
        largest = np.where(length > 0, np.maximum(largest, gap), largest)
    return largest * size


def mesh_gaps(
    corners_a: NDArray[np.floating], corners_b: NDArray[np.floating], poses: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(s, 3, 3), (t, 3, 3) and (n, 4, 4) poses of b -> (n,) the least gap of any pair of triangles at each.

    Gaps above a thousandth of the meshes' size may come out too large: pairs with boxes that far apart are left out.
    """
    pairs_a, pairs_b, counts = [], [], []
    for pose in poses:
        first, second = _nearest_boxes(corners_a.astype(np.longdouble), _moved(corners_b, pose))
        pairs_a.append(first)
        pairs_b.append(second)
        counts.append(len(first))
    starts = np.cumsum(counts) - counts
    a, b = np.concatenate(pairs_a), np.concatenate(pairs_b)
    # Plain float64 tells which pairs are worth the extended precision.
    rough = _in_parts(a, b, np.float64)
    limit = np.minimum.reduceat(rough, starts) + 1e-6 * np.abs(np.maximum.reduceat(_extent(a, b), starts))
    near = rough <= np.repeat(limit, counts)
    gaps = np.full(len(a), np.inf, dtype=np.longdouble)
    gaps[near] = _in_parts(a[near], b[near], np.longdouble)
    return np.minimum.reduceat(gaps, starts).astype(np.float64)


def _moved(corners: NDArray[np.floating], pose: NDArray[np.float64]) -> Real:
    rotation, translation = pose[:3, :3].astype(np.longdouble), pose[:3, 3].astype(np.longdouble)
    moved: Real = np.einsum("tij,kj->tik", corners.astype(np.longdouble), rotation) + translation
    return moved


def _extent(a: Real, b: Real) -> Real:
    extent: Real = np.maximum(np.ptp(a, axis=1).max(axis=1), np.ptp(b, axis=1).max(axis=1))
    return extent


def _nearest_boxes(a: Real, b: Real) -> tuple[Real, Real]:
    """Pairs of triangles whose boxes are nearest, or hardly further: a pair's gap is at least its boxes'."""
    low_a, high_a, low_b, high_b = a.min(axis=1), a.max(axis=1), b.min(axis=1), b.max(axis=1)
    apart = np.maximum(low_a[:, None] - high_b[None], low_b[None] - high_a[:, None]).max(axis=2)
    size = max(float(high_a.max() - low_a.min()), float(high_b.max() - low_b.min()))
    s, t = np.nonzero(apart <= max(float(apart.min()), 0.0) + 1e-3 * size)
    return a[s], b[t]


def _in_parts(a: Real, b: Real, precision: type) -> Real:
    parts = [slice(i, i + _PAIRS_AT_ONCE) for i in range(0, len(a), _PAIRS_AT_ONCE)]
    return np.concatenate([triangle_gaps(a[part], b[part], precision) for part in parts])
