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


def _nearest_in_triangles(p: FloatArray, triangles: FloatArray) -> FloatArray:
    """(n, 3): points of (n, 3, 3) triangles nearest to (n, 3) points: of the plane's, where inside, or an edge's."""
    best, least = triangles[:, 0], np.full(len(p), np.inf)
    for i in range(3):
        a, edge = triangles[:, i], triangles[:, (i + 1) % 3] - triangles[:, i]
        length2 = (edge**2).sum(axis=1)
        t = np.clip(((p - a) * edge).sum(axis=1) / np.where(length2 > 0, length2, 1.0), 0, 1)
        candidate = a + edge * t[:, None]
        distance = np.linalg.norm(candidate - p, axis=1)
        best, least = np.where((distance < least)[:, None], candidate, best), np.minimum(distance, least)
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    length2 = (normal**2).sum(axis=1)
    foot = p - normal * (((p - triangles[:, 0]) * normal).sum(axis=1) / np.where(length2 > 0, length2, 1.0))[:, None]
    inside = length2 > 0
    for i in range(3):
        edge = triangles[:, (i + 1) % 3] - triangles[:, i]
        inside &= (np.cross(edge, foot - triangles[:, i]) * normal).sum(axis=1) >= 0
    return np.where(inside[:, None], foot, best)


def distance_bounds(
    triangles: FloatArray, centres: FloatArray, halves: FloatArray, sweeps: int = 400
) -> tuple[FloatArray, FloatArray]:
    """(n,), (n,): bounds below and above of the distances of n disjoint pairs of (n, 3, 3) triangles and (n,) cubes.

    Alternating projections (von Neumann) give points of both, whose distance is an upper bound; the slab between two
    planes across the way from one to the other separates the pair, and its width is a lower bound.
    """
    relative = triangles - centres[:, None]
    on_triangle = relative.mean(axis=1)
    h = halves[:, None]
    for _ in range(sweeps):
        on_cube = np.clip(on_triangle, -h, h)
        on_triangle = _nearest_in_triangles(on_cube, relative)
    on_cube = np.clip(on_triangle, -h, h)
    upper = np.linalg.norm(on_triangle - on_cube, axis=1)
    way = (on_triangle - on_cube) / np.where(upper > 0, upper, 1.0)[:, None]
    lower = np.einsum("nkc,nc->nk", relative, way).min(axis=1) - halves * np.abs(way).sum(axis=1)
    return np.maximum(lower, 0), upper
