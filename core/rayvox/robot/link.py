"""The rigid bodies of a robot."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.collision_mesh import CollisionMesh, MeshBvh
from rayvox.errors import InvalidInputError
from rayvox.mesh_io import TriangleMesh
from rayvox.mesh_io.triangle_mesh import MeshParts
from rayvox.robot.bounding_capsule import NO_CAPSULE, bounding_capsule
from rayvox.robot.level_of_detail import simplified

# Accuracies of the levels of detail: this and its doubles.
_FINEST_LEVEL_M = 0.0005
_LEVELS = 12


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
class LinkBody:
    """A link as queries against maps take it: its hierarchy, and the padding that makes up for what it misses."""

    native: _native.LinkBody | None
    error_m: float


@dataclass(frozen=True, eq=False)
class Link:
    """One rigid body, with what is fastened to it as geometry. padding_m: by how much queries are to grow it."""

    name: str
    geometries: tuple[LinkGeometry, ...] = ()
    padding_m: float = 0.0
    _levels: dict[int, LinkBody] = field(default_factory=dict, init=False, repr=False)

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

    def body_within(self, accuracy_m: float | None) -> LinkBody:
        """A body that, padded by its error, touches whatever the link touches, and nothing further away than
        accuracy_m; of the link's own mesh for None. Raises InvalidInputError."""
        if accuracy_m is not None and not 0 < accuracy_m < np.inf:
            raise InvalidInputError(f"accuracy_m = {accuracy_m!r} is not a finite number above zero")
        exact = LinkBody(self.body, 0.0)
        if accuracy_m is None or accuracy_m < _FINEST_LEVEL_M or self.body is None:
            return exact
        level = min(int(np.log2(accuracy_m / _FINEST_LEVEL_M)), _LEVELS - 1)
        if level not in self._levels:
            self._levels[level] = self._simplified_body(_FINEST_LEVEL_M * 2.0**level) or exact
        return self._levels[level]

    def _simplified_body(self, accuracy_m: float) -> LinkBody | None:
        # Half of the accuracy for what the simpler mesh misses, half for what it adds.
        level = simplified(self.mesh, accuracy_m / 2, accuracy_m / 2)
        if level.mesh is self.mesh or self.body is None:
            return None
        surface = CollisionMesh(level.mesh.vertices, level.mesh.triangles).bvh()
        return LinkBody(_native.LinkBody(surface.native, self.body), level.error_m)

    @property
    def is_closed(self) -> bool:
        """Whether all of its geometry is closed. Without geometry: False."""
        return bool(self.geometries) and all(geometry.is_closed for geometry in self.geometries)
