"""Collision queries between two meshes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, overload

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.arrays import as_poses
from rayvox.collision_mesh import MeshBvh

_CONTAINED = 2


@dataclass(frozen=True)
class TraversalStatistics:
    """Work per pose, (n,) int64 each."""

    node_pairs: npt.NDArray[np.int64]
    """Pairs of bounding volumes tested."""
    axis_tests: npt.NDArray[np.int64]
    """Axes looked at, counted once for all lanes of a vector test."""
    triangle_pairs: npt.NDArray[np.int64]
    """Pairs of triangles tested."""
    undecided: npt.NDArray[np.int64]
    """Of those, pairs that float32 could not decide."""


@dataclass(frozen=True)
class CollisionContacts:
    """What a query with contacts found, for n poses."""

    colliding: npt.NDArray[np.bool_]
    """(n,): surfaces touch, or one is inside the other."""
    contained: npt.NDArray[np.bool_]
    """(n,): no surfaces touch, but a part of one mesh is inside a solid of the other."""
    pose: npt.NDArray[np.int64]
    """(m,): pose index of each contact, ascending."""
    triangles: npt.NDArray[np.int64]
    """(m, 2): indices of the triangles of a and of b that touch."""
    statistics: TraversalStatistics


@overload
def collide(
    bvh_a: MeshBvh,
    bvh_b: MeshBvh,
    T_a_b: npt.ArrayLike | None = None,
    contacts: Literal[False] = False,
    solids: bool = True,
) -> npt.NDArray[np.bool_]: ...
@overload
def collide(
    bvh_a: MeshBvh,
    bvh_b: MeshBvh,
    T_a_b: npt.ArrayLike | None = None,
    *,
    contacts: Literal[True, "first"],
    solids: bool = True,
) -> CollisionContacts: ...
def collide(
    bvh_a: MeshBvh,
    bvh_b: MeshBvh,
    T_a_b: npt.ArrayLike | None = None,
    contacts: bool | Literal["first"] = False,
    solids: bool = True,
) -> npt.NDArray[np.bool_] | CollisionContacts:
    """Whether mesh b, placed in the frame of mesh a by each pose, collides with a; on all threads, without the GIL.

    T_a_b: (n, 4, 4) or (4, 4) rigid, float64; a point of b is at T_a_b @ point in a's frame. None is the identity.
    contacts: False returns (n,) bool. True: every pair of triangles that touch; "first": one of them per pose; both
    return CollisionContacts. Touching counts as collision, and the answer is exact for the vertices and poses given, up
    to their rounding when placed (1e-15 of the meshes' size).
    solids: a part of one mesh inside a closed part of the other collides though no surfaces touch.

    Raises InvalidInputError for a pose that is not rigid, naming its index, and for hierarchies built with different
    traversals, slabs or axes.
    """
    poses = as_poses(T_a_b, "T_a_b")
    mode = "none" if contacts is False else "all" if contacts is True else contacts
    state, rows, counts = _native.collide(bvh_a.native, bvh_b.native, poses, mode, solids, mode != "none")
    if mode == "none":
        return state.astype(np.bool_)
    return CollisionContacts(
        colliding=state.astype(np.bool_),
        contained=state == _CONTAINED,
        pose=rows[:, 0],
        triangles=rows[:, 1:],
        statistics=TraversalStatistics(*counts.T),
    )
