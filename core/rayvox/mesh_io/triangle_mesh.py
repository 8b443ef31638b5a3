"""Triangles, and which of them bound a solid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.arrays import as_points_f64
from rayvox.errors import InvalidInputError


@dataclass(frozen=True)
class MeshParts:
    """Parts of a mesh: triangles that hang together over edges shared by exactly two of them.

    part: (m,) int32 per triangle, -1 for one that repeats another or is only a line or a point.
    closed: per part, whether it has an inside: each of its edges has an even number of its triangles.
    """

    part: npt.NDArray[np.int32]
    closed: npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Immutable triangles.

    vertices: (n, 3) float64, metres. triangles: (m, 3) int32 indices of vertices. Raises InvalidInputError for other
    shapes, a vertex that is not finite or an index out of range.
    """

    vertices: npt.NDArray[np.float64]
    triangles: npt.NDArray[np.int32]

    def __post_init__(self) -> None:
        vertices = as_points_f64(self.vertices, "vertices").copy()
        triangles = np.asarray(self.triangles)
        if triangles.ndim != 2 or triangles.shape[1] != 3 or triangles.dtype.kind not in "iu":
            raise InvalidInputError(f"triangles must be (m, 3) integers, got {triangles.dtype} {triangles.shape}")
        _refuse_bad_rows(np.isfinite(vertices), vertices, "vertices", "is not finite")
        inside = (triangles >= 0) & (triangles < len(vertices))
        _refuse_bad_rows(inside, triangles, "triangles", f"names a vertex outside of 0 to {len(vertices) - 1}")
        triangles = np.array(triangles, dtype=np.int32, order="C")
        vertices.flags.writeable = triangles.flags.writeable = False
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)

    @classmethod
    def concatenate(cls, meshes: Sequence[TriangleMesh]) -> TriangleMesh:
        """All triangles in one mesh; an empty one for no meshes."""
        if len(meshes) == 1:
            return meshes[0]
        offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
        vertices = [np.zeros((0, 3)), *(mesh.vertices for mesh in meshes)]
        triangles = [mesh.triangles + offset for mesh, offset in zip(meshes, offsets, strict=False)]
        return cls(np.concatenate(vertices), np.concatenate([np.zeros((0, 3), np.int64), *triangles]))

    def __len__(self) -> int:
        return len(self.triangles)

    def __repr__(self) -> str:
        return f"TriangleMesh({len(self.vertices)} vertices, {len(self.triangles)} triangles)"

    @property
    def bounds_m(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Lowest and highest corner of what the triangles cover. Raises InvalidInputError for an empty mesh."""
        if len(self) == 0:
            raise InvalidInputError("an empty mesh has no bounds")
        corners = self.vertices[self.triangles.ravel()]
        return corners.min(axis=0), corners.max(axis=0)

    def corners(self) -> npt.NDArray[np.float64]:
        """(m, 3, 3): the three corners of each triangle."""
        return self.vertices[self.triangles]

    def scaled(self, factors: float | Sequence[float]) -> TriangleMesh:
        """Scaled about the origin, by one factor or three; negative ones mirror."""
        return TriangleMesh(self.vertices * np.asarray(factors, dtype=np.float64), self.triangles)

    def transformed(self, T: npt.NDArray[np.float64]) -> TriangleMesh:
        """Moved by an affine (4, 4) transform."""
        return TriangleMesh(self.vertices @ T[:3, :3].T + T[:3, 3], self.triangles)

    def welded(self) -> TriangleMesh:
        """With one vertex per place, and without vertices that no triangle uses."""
        places = _native.weld_vertices(self.vertices)[self.triangles]
        _, first, triangles = np.unique(places, return_index=True, return_inverse=True)
        return TriangleMesh(self.vertices[self.triangles.ravel()[first]], triangles.reshape(-1, 3).astype(np.int32))

    def parts(self) -> MeshParts:
        """Which triangles belong together and which of the parts are closed."""
        return MeshParts(*_native.mesh_parts(self.vertices, self.triangles))


def _refuse_bad_rows(good: npt.NDArray[np.bool_], rows: npt.NDArray[np.generic], name: str, fault: str) -> None:
    if not good.all():
        first = int(np.argmin(good)) // 3
        raise InvalidInputError(f"{name}[{first}] = {rows[first].tolist()} {fault}")
