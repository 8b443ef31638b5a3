"""Fewer triangles where a map could not tell the difference."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rayvox import _native
from rayvox.errors import InvalidInputError
from rayvox.mesh_io import TriangleMesh

# Below this a mesh costs so little that simplifying it gains nothing.
LEAST_TRIANGLES = 32
_REFINEMENTS = 3
_ANY_ERROR = 1.0  # of the mesh's extent: the count alone decides, the error is proven afterwards


@dataclass(frozen=True, eq=False)
class LevelOfDetail:
    """A simplified mesh, and a proven bound of what it misses.

    Every point of the original surface lies within `error_m` of this mesh's surface, so that the mesh padded by it
    touches whatever the original surface touches. That is the surface: whether a point that is farther from it lies
    inside a solid must be asked of the original mesh, since the bound says nothing of what the simplified one encloses.
    """

    mesh: TriangleMesh
    error_m: float


def simplified(mesh: TriangleMesh, error_m: float) -> LevelOfDetail:
    """The smallest mesh found whose proven error is at most `error_m`; the mesh itself, with error 0, at worst.

    Quadric edge collapse (Garland, Heckbert: Surface simplification using quadric error metrics, SIGGRAPH 1997; by
    meshoptimizer) proposes meshes of ever fewer triangles, the kernel's surface_deviation proves each. Raises
    InvalidInputError for an error that is not a finite number of at least zero.
    """
    if not (math.isfinite(error_m) and error_m >= 0):
        raise InvalidInputError(f"error_m = {error_m!r} is not a finite number of at least zero")
    best = LevelOfDetail(mesh, 0.0)
    if error_m == 0 or len(mesh) <= LEAST_TRIANGLES:
        return best
    # Relative to a place of its own the mesh keeps its precision in the library's float32.
    middle = mesh.vertices.mean(axis=0)
    welded = TriangleMesh(mesh.vertices - middle, mesh.triangles).welded()
    # Halved until the error is too large, then bisected between the last two counts.
    enough, too_few = len(mesh), 0
    refinements = 0
    while refinements < _REFINEMENTS and enough > LEAST_TRIANGLES:
        target = enough // 2 if too_few == 0 else (enough + too_few) // 2
        refinements += too_few > 0
        attempt = _collapsed(welded, target)
        deviation_m = _deviation(welded, attempt, error_m)
        if deviation_m + _rounding_m(mesh) <= error_m and len(attempt) < len(best.mesh):
            moved_back = TriangleMesh(attempt.vertices + middle, attempt.triangles).welded()
            best = LevelOfDetail(moved_back, deviation_m + _rounding_m(mesh))
            enough = target
        else:
            too_few = target
    return best


def _collapsed(welded: TriangleMesh, triangles: int) -> TriangleMesh:
    import meshoptimizer

    indices = welded.triangles.astype(np.uint32).ravel()
    kept = np.zeros_like(indices)
    count = meshoptimizer.simplify(
        kept,
        indices,
        welded.vertices.astype(np.float32),
        target_index_count=3 * triangles,
        target_error=_ANY_ERROR,
    )
    # What is kept are vertices of the original, in full precision.
    return TriangleMesh(welded.vertices, kept[:count].reshape(-1, 3).astype(np.int32))


def _rounding_m(mesh: TriangleMesh) -> float:
    """More than what moving there and back changes of a coordinate."""
    return float(8 * np.finfo(np.float64).eps * np.abs(mesh.vertices).max())


def _deviation(original: TriangleMesh, attempt: TriangleMesh, limit_m: float) -> float:
    if len(attempt) == 0:
        return math.inf
    tree = _native.TriangleTree(attempt.vertices, attempt.triangles)
    return tree.deviation_of(original.vertices, original.triangles, limit_m)
