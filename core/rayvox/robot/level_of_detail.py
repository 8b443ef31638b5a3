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
# Attempts ask the library for ever smaller errors, by this factor, down to this share of the error allowed.
STEP = 0.75
LEAST_SHARE = 0.03


@dataclass(frozen=True, eq=False)
class LevelOfDetail:
    """A simplified mesh, and a proven bound of what it misses.

    Every point of the original surface lies within `error_m` of this mesh's surface, so that the mesh padded by it
    touches whatever the original surface touches. That is the surface: whether a point that is farther from it lies
    inside a solid must be asked of the original mesh, since the bound says nothing of what the simplified one encloses.
    """

    mesh: TriangleMesh
    error_m: float


def simplified(mesh: TriangleMesh, error_m: float, added_m: float = math.inf) -> LevelOfDetail:
    """The smallest mesh found whose proven error is at most `error_m`; the mesh itself, with error 0, at worst.

    Quadric edge collapse (Garland, Heckbert: Surface simplification using quadric error metrics, SIGGRAPH 1997; by
    meshoptimizer) proposes meshes of ever fewer triangles, the kernel's surface_deviation proves each. added_m: no
    point of the simplified surface is further away from the original one. Raises InvalidInputError for an error that is
    not a finite number of at least zero.
    """
    if not (math.isfinite(error_m) and error_m >= 0):
        raise InvalidInputError(f"error_m = {error_m!r} is not a finite number of at least zero")
    unchanged = LevelOfDetail(mesh, 0.0)
    if error_m == 0 or len(mesh) <= LEAST_TRIANGLES:
        return unchanged
    # Relative to a place of its own the mesh keeps its precision in the library's float32.
    middle = mesh.vertices.mean(axis=0)
    welded = TriangleMesh(mesh.vertices - middle, mesh.triangles).welded()
    # The library's own measure is a mean where the proven one is a maximum: the coarsest attempts fail, and fast.
    asked_m = error_m
    while asked_m > LEAST_SHARE * error_m:
        attempt = _collapsed(welded, asked_m)
        deviation_m = _deviation(welded, attempt, error_m) + _rounding_m(mesh)
        if (
            deviation_m <= error_m
            and len(attempt) < len(mesh)
            and (added_m == math.inf or _deviation(attempt, welded, added_m) + _rounding_m(mesh) <= added_m)
        ):
            return LevelOfDetail(TriangleMesh(attempt.vertices + middle, attempt.triangles).welded(), deviation_m)
        asked_m *= STEP
    return unchanged


def _collapsed(welded: TriangleMesh, error_m: float) -> TriangleMesh:
    import meshoptimizer

    indices = welded.triangles.astype(np.uint32).ravel()
    kept = np.zeros_like(indices)
    count = meshoptimizer.simplify(
        kept,
        indices,
        welded.vertices.astype(np.float32),
        target_index_count=0,
        target_error=error_m,
        options=meshoptimizer.SIMPLIFY_ERROR_ABSOLUTE,
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
