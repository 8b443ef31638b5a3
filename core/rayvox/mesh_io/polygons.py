"""Polygons to triangles that cover the same area, concave ones too."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from rayvox.errors import MeshFormatError
from rayvox.mesh_io.load_limits import LoadBudget
from rayvox.mesh_io.triangle_mesh import TriangleMesh

Indices = npt.NDArray[np.int64]
# A concave polygon is cut ear by ear, at a cost that grows with the square of its corners.
MOST_CONCAVE_CORNERS = 2000


@dataclass
class Polygons:
    """Faces as a file lists them: numbers of corners, and the corners of all one after the other."""

    counts: list[Indices] = field(default_factory=list)
    corners: list[Indices] = field(default_factory=list)

    def add(self, counts: npt.ArrayLike, corners: npt.ArrayLike) -> None:
        self.counts.append(np.asarray(counts, dtype=np.int64).ravel())
        self.corners.append(np.asarray(corners, dtype=np.int64).ravel())

    def mesh(self, vertices: npt.NDArray[np.float64], budget: LoadBudget, source: str) -> TriangleMesh:
        """A mesh of these vertices. Faces of fewer than three corners are points and lines, and have none.

        Raises MeshFormatError for corners that are no vertices, LoadLimitError.
        """
        counts = np.concatenate([np.zeros(0, np.int64), *self.counts])
        corners = np.concatenate([np.zeros(0, np.int64), *self.corners])
        if (counts < 0).any() or counts.sum() != len(corners):
            raise MeshFormatError(f"{source}: faces of {counts.sum()} corners list {len(corners)}")
        outside = (corners < 0) | (corners >= len(vertices))
        if outside.any():
            raise MeshFormatError(
                f"{source}: a face names vertex {corners[np.argmax(outside)]}, there are {len(vertices)}"
            )
        budget.take_triangles(int(np.maximum(counts - 2, 0).sum()), source)
        starts = np.cumsum(counts) - counts
        parts = [np.zeros((0, 3), np.int64)]
        for count in np.unique(counts[counts >= 3]):
            faces = corners[starts[counts == count][:, None] + np.arange(count)]
            parts.append(faces if count == 3 else _cut(faces, vertices, budget, source))
        return TriangleMesh(vertices, np.concatenate(parts).astype(np.int32))


def _cut(faces: Indices, vertices: npt.NDArray[np.float64], budget: LoadBudget, source: str) -> Indices:
    """Faces (f, n) of n > 3 corners to triangles: convex ones as fans, the others ear by ear."""
    points = vertices[faces]
    normals = np.cross(points - points[:, :1], np.roll(points, -1, axis=1) - points[:, :1]).sum(axis=1)
    edges = np.roll(points, -1, axis=1) - points
    turns = np.einsum("fnk,fk->fn", np.cross(np.roll(edges, 1, axis=1), edges), normals)
    # A star turns left everywhere too, but more than once around.
    convex = (turns >= -1e-12 * np.abs(turns).max(axis=1, keepdims=True)).all(axis=1) & _turns_once(edges)
    n = faces.shape[1]
    fan = np.stack([np.zeros(n - 2, np.int64), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    parts = [faces[convex][:, fan].reshape(-1, 3)]
    for face, outline, normal in zip(faces[~convex], points[~convex], normals[~convex], strict=True):
        if n > MOST_CONCAVE_CORNERS:
            raise MeshFormatError(f"{source}: a concave polygon of {n} corners, the limit is {MOST_CONCAVE_CORNERS}")
        budget.check_time(source)
        parts.append(face[_clip_ears(outline, normal)])
    return np.concatenate(parts)


def _turns_once(edges: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    lengths = np.linalg.norm(edges, axis=2)
    after, lengths_after = np.roll(edges, -1, axis=1), np.roll(lengths, -1, axis=1)
    both = lengths * lengths_after
    cosine = np.divide(np.einsum("fnk,fnk->fn", edges, after), both, out=np.ones_like(both), where=both > 0)
    turned: npt.NDArray[np.bool_] = np.arccos(np.clip(cosine, -1, 1)).sum(axis=1) < 3 * np.pi
    return turned


def _clip_ears(outline: npt.NDArray[np.float64], normal: npt.NDArray[np.float64]) -> Indices:
    """Triangles (n - 2, 3) of one simple polygon, in the plane that its normal is most upright on."""
    drop = int(np.argmax(np.abs(normal)))
    x, y = (outline[:, axis] for axis in range(3) if axis != drop)
    sign = np.sign(normal[drop]) * (-1 if drop == 1 else 1)

    def area(a: int, b: int, c: Indices | int) -> npt.NDArray[np.float64]:
        doubled: npt.NDArray[np.float64] = sign * ((x[b] - x[a]) * (y[c] - y[a]) - (x[c] - x[a]) * (y[b] - y[a]))
        return doubled

    left = list(range(len(outline)))
    triangles = []
    while len(left) > 3:
        for i, tip in enumerate(left):
            before, after = left[i - 1], left[(i + 1) % len(left)]
            if area(before, tip, after) <= 0:
                continue
            others = np.array([k for k in left if k not in (before, tip, after)])
            inside = (area(before, tip, others) >= 0) & (area(tip, after, others) >= 0)
            if not (inside & (area(after, before, others) >= 0)).any():
                break
        else:
            i = 0  # crosses itself, or has no area left: any cut is as good
        triangles.append((left[i - 1], left[i], left[(i + 1) % len(left)]))
        del left[i]
    return np.array([*triangles, tuple(left)], dtype=np.int64)
