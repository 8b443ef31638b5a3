"""Triangle meshes and their bounding volume hierarchies."""

from __future__ import annotations

import os
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.arrays import as_points, as_points_f64
from rayvox.errors import InvalidInputError
from rayvox.mesh_io import LoadLimits, read_mesh

Construction = Literal["bng", "longest_axis", "extended_longest_axis", "sah"]
Slabs = Literal["float16", "float32"]
Traversal = Literal["hybrid", "4vs4", "1vs16", "simd_binary", "binary"]

# Branching factor and most triangles in a leaf of each traversal, where none is given.
_SHAPE_OF_TRAVERSAL: dict[str, tuple[int, int]] = {
    "hybrid": (16, 16),
    "4vs4": (4, 8),
    "1vs16": (16, 8),
    "simd_binary": (2, 1),
    "binary": (2, 1),
}


class CollisionMesh:
    """An immutable triangle mesh.

    vertices: (n, 3) float32 or float64, metres, the mesh's own frame. triangles: (m, 3) integers, vertex indices.
    Any soup is accepted: open, degenerate, duplicated or intersecting triangles. Parts of it (connected through equal
    positions) whose every edge has an even number of triangles bound solids.

    Raises InvalidInputError for no triangle, a coordinate that is not finite or beyond 1e11 m, an index out of range.
    """

    def __init__(self, vertices: npt.ArrayLike, triangles: npt.ArrayLike) -> None:
        points = as_points(vertices, "vertices").astype(np.float64, copy=False)
        indices = np.asarray(triangles)
        if indices.ndim != 2 or indices.shape[1] != 3 or indices.dtype.kind not in "iu":
            raise InvalidInputError(
                f"triangles must be integers of shape (m, 3), got {indices.dtype} of shape {indices.shape}"
            )
        self.native = _native.CollisionMesh(points, np.ascontiguousarray(indices, dtype=np.int64))

    @classmethod
    def from_file(
        cls, path: str | os.PathLike[str], scale: float = 1.0, limits: LoadLimits | None = None
    ) -> CollisionMesh:
        """From an STL, OBJ, PLY, OFF, DAE or GLB file, whose units times `scale` are metres.

        Raises MeshFormatError, LoadLimitError, OSError, and InvalidInputError for a scale that is not positive.
        """
        if not (np.isfinite(scale) and scale > 0):
            raise InvalidInputError(f"scale must be positive, got {scale}")
        mesh = read_mesh(path, limits)
        return cls(mesh.vertices * scale, mesh.triangles)

    @property
    def triangle_count(self) -> int:
        """Triangles, degenerate ones included."""
        return self.native.triangle_count

    @property
    def component_count(self) -> int:
        """Connected parts."""
        return self.native.component_count

    @property
    def radius_m(self) -> float:
        """Largest distance of a corner from the centre of the mesh's box."""
        return self.native.radius_m

    @property
    def is_closed(self) -> bool:
        """Whether every connected part bounds a solid."""
        return self.native.is_closed

    def bvh(
        self,
        k: int = 32,
        branching_factor: int | None = None,
        construction: Construction = "bng",
        slabs: Slabs = "float16",
        traversal: Traversal = "hybrid",
        leaf_size: int | None = None,
        axes: npt.ArrayLike | None = None,
        seed: int = 1,
    ) -> MeshBvh:
        """A wrapped hierarchy of k-DOPs (SIMDop, Sec. IV), built on all threads.

        k: orientations, 6, 8, 14, 16, 18, 24, 26 or 32; or axes: (k/2, 3), 3 to 16 directions, normalised here.
        branching_factor: 2, 4, 8 or 16; None is what suits the traversal.
        construction: "bng" (Batch Neural Gas, Sec. IV-A.3; deterministic for a seed), "longest_axis" (IV-A.1),
        "extended_longest_axis" (IV-A.2), or "sah" (surface area heuristic, binary trees only).
        slabs: "float16" (rounded outward) or "float32"; hybrid traversal keeps 16-bit integers instead.
        traversal (Sec. IV-B): "1vs16" one node against 16 children, "4vs4" four against four (branching factor 4),
        "simd_binary" sixteen axes of one pair of nodes at a time, "binary" one axis at a time, or "hybrid": oriented
        boxes, which near the leaves are thinner than k-DOPs, of sixteen waiting pairs of nodes at a time, then their
        k-DOPs; the fastest.
        leaf_size: most triangles of a leaf, 1 to 16; None is what suits the traversal.

        Raises InvalidInputError for options that do not exist or do not fit together.
        """
        if traversal not in get_args(Traversal):
            raise InvalidInputError(f"traversal must be one of {', '.join(get_args(Traversal))}, got {traversal!r}")
        usual_factor, usual_leaf = _SHAPE_OF_TRAVERSAL[traversal]
        return MeshBvh(
            self,
            _native.build_kdop_bvh(
                self.native,
                k,
                None if axes is None else as_points_f64(axes, "axes"),
                usual_factor if branching_factor is None else branching_factor,
                construction,
                slabs,
                traversal,
                usual_leaf if leaf_size is None else leaf_size,
                seed,
            ),
        )


class MeshBvh:
    """A mesh's hierarchy, made by CollisionMesh.bvh. Immutable; usable from any thread."""

    def __init__(self, mesh: CollisionMesh, native: _native.KdopBvh) -> None:
        self.mesh = mesh
        self.native = native

    @property
    def node_count(self) -> int:
        """Inner nodes and leaves."""
        return self.native.node_count

    @property
    def depth(self) -> int:
        """Levels below the root."""
        return self.native.depth

    @property
    def k(self) -> int:
        """Orientations of its k-DOPs."""
        return self.native.k

    @property
    def nbytes(self) -> int:
        """Bytes held, the mesh not included."""
        return self.native.nbytes
