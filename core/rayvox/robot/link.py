"""The rigid bodies of a robot."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.collision_mesh import CollisionMesh, MeshBvh
from rayvox.mesh_io import TriangleMesh
from rayvox.mesh_io.triangle_mesh import MeshParts
from rayvox.robot.bounding_capsule import NO_CAPSULE, bounding_capsule


@dataclass(frozen=True, eq=False)
class LinkGeometry:
    """One collision body of a link.

    shape: what it was described as: mesh, box, cylinder or sphere.
    mesh: in the link's frame, metres; contains the shape, and reaches beyond it by at most `excess_m`.
    parts: which triangles bound a solid; what belongs to no closed part is a surface without an inside.
    """

    shape: str
    mesh: TriangleMesh
    excess_m: float = 0.0
    parts: MeshParts = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "parts", self.mesh.parts())

    @property
    def is_closed(self) -> bool:
        """Whether every part of it has an inside."""
        return bool(len(self.parts.closed) and self.parts.closed.all())


@dataclass(frozen=True, eq=False)
class Link:
    """One rigid body, with what is fastened to it as geometry. padding_m: by how much queries are to grow it."""

    name: str
    geometries: tuple[LinkGeometry, ...] = ()
    padding_m: float = 0.0

    @cached_property
    def mesh(self) -> TriangleMesh:
        """All triangles of the link in its frame; empty where it has no geometry."""
        return TriangleMesh.concatenate([geometry.mesh for geometry in self.geometries])

    @cached_property
    def capsule(self) -> npt.NDArray[np.float64]:
        """(7,): both ends of a segment and the radius around it that holds the mesh; radius -1 without geometry."""
        return bounding_capsule(self.mesh.vertices) if self.geometries else NO_CAPSULE

    @cached_property
    def bvh(self) -> MeshBvh | None:
        """The mesh's hierarchy for collision queries; None without geometry."""
        return CollisionMesh(self.mesh.vertices, self.mesh.triangles).bvh() if self.geometries else None

    @cached_property
    def body(self) -> _native.LinkBody | None:
        """The hierarchy as queries against maps traverse it; None without geometry."""
        return _native.LinkBody(self.bvh.native) if self.bvh is not None else None

    @property
    def is_closed(self) -> bool:
        """Whether all of its geometry is closed. Without geometry: False."""
        return bool(self.geometries) and all(geometry.is_closed for geometry in self.geometries)
