"""Fewer triangles where a map could not tell the difference."""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass

import numpy as np

from rayvox import _native
from rayvox.errors import InvalidInputError
from rayvox.mesh_io import TriangleMesh

# Below this a mesh costs so little that simplifying it gains nothing.
LEAST_TRIANGLES = 32
_REFINEMENTS = 3
_simplifying = threading.Lock()


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

    Quadric edge collapse (Garland, Heckbert: Surface simplification using quadric error metrics, SIGGRAPH 1997)
    proposes meshes of ever fewer triangles, the kernel's surface_deviation proves each. Raises InvalidInputError for an
    error that is not a finite number of at least zero.
    """
    if not (math.isfinite(error_m) and error_m >= 0):
        raise InvalidInputError(f"error_m = {error_m!r} is not a finite number of at least zero")
    best = LevelOfDetail(mesh, 0.0)
    if error_m == 0 or len(mesh) <= LEAST_TRIANGLES:
        return best
    welded = mesh.welded()
    # Halved until the error is too large, then bisected between the last two counts.
    enough, too_few = len(mesh), 0
    refinements = 0
    while refinements < _REFINEMENTS and enough > LEAST_TRIANGLES:
        target = enough // 2 if too_few == 0 else (enough + too_few) // 2
        refinements += too_few > 0
        attempt = _collapsed(welded, target)
        deviation_m = _deviation(mesh, attempt, error_m)
        if deviation_m <= error_m and len(attempt) < len(best.mesh):
            best = LevelOfDetail(attempt, deviation_m)
            enough = target
        else:
            too_few = target
    return best


def _collapsed(welded: TriangleMesh, triangles: int) -> TriangleMesh:
    import fast_simplification

    # The library keeps the mesh it works on in global variables.
    with _simplifying:
        vertices, faces = fast_simplification.simplify(
            np.array(welded.vertices), np.array(welded.triangles), target_count=triangles
        )
    return TriangleMesh(vertices, np.asarray(faces, dtype=np.int32))


def _deviation(original: TriangleMesh, attempt: TriangleMesh, limit_m: float) -> float:
    if len(attempt) == 0:
        return math.inf
    tree = _native.TriangleTree(attempt.vertices, attempt.triangles)
    return tree.deviation_of(original.vertices, original.triangles, limit_m)
