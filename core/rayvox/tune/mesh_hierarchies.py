"""Hierarchies of k-DOPs over a robot's triangles: k, branching factor, half floats and traversal.

All give the same verdicts, so that only time and memory are measured: of mesh against mesh, as for self-collision and
parts. Queries against maps traverse the oriented boxes of "hybrid" hierarchies, which have no such choice.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from statistics import median

import numpy as np

from rayvox.collide import collide
from rayvox.collision_mesh import CollisionMesh, MeshBvh, Slabs, Traversal
from rayvox.mesh_io import TriangleMesh
from rayvox.robot import Robot
from rayvox.tune.ground_truth import FloatArray
from rayvox.tune.machine_speed import clock_s

_POSES, _REPEATS = 400, 5


@dataclass(frozen=True, slots=True)
class Hierarchy:
    """Arguments of CollisionMesh.bvh; branching_factor None is what suits the traversal. slabs: not of "hybrid"."""

    traversal: Traversal = "hybrid"
    k: int = 32
    branching_factor: int | None = None
    slabs: Slabs = "float16"

    def __str__(self) -> str:
        branching = "" if self.branching_factor is None else f", {self.branching_factor}-ary"
        slabs = "" if self.traversal == "hybrid" else f", {self.slabs}"
        return f"{self.traversal}, k = {self.k}{branching}{slabs}"


@dataclass(frozen=True, slots=True)
class HierarchyFigures:
    """query_s: seconds a pose of one copy of the robot near another; nbytes: of one hierarchy."""

    query_s: float
    nbytes: float


HIERARCHIES = (
    Hierarchy(),
    Hierarchy(branching_factor=8),
    Hierarchy(branching_factor=4),
    *(Hierarchy("1vs16", k) for k in (8, 14, 18, 26, 32)),
    Hierarchy("1vs16", slabs="float32"),
    Hierarchy("1vs16", branching_factor=8),
    Hierarchy("4vs4"),
    Hierarchy("4vs4", slabs="float32"),
    Hierarchy("simd_binary"),
    Hierarchy("binary"),
)


@dataclass(frozen=True, eq=False)
class HierarchyProbe:
    """A robot in its resting configuration, as one mesh, and poses of a second one just about where both touch."""

    robot: Robot
    seed: int = 0

    @cached_property
    def mesh(self) -> CollisionMesh:
        poses = self.robot.link_poses(self.robot.configuration())[0]
        solid = [(link, T) for link, T in zip(self.robot.links, poses, strict=True) if link.geometries]
        whole = TriangleMesh.concatenate([link.mesh.transformed(T) for link, T in solid])
        return CollisionMesh(whole.vertices, whole.triangles)

    @cached_property
    def poses(self) -> FloatArray:
        rng = np.random.default_rng(self.seed)
        directions = rng.normal(size=(_POSES, 3))
        T = np.tile(np.eye(4), (_POSES, 1, 1))
        T[:, :3, :3] = np.linalg.qr(rng.normal(size=(_POSES, 3, 3)))[0]
        T[:, :3, 0] *= np.linalg.det(T[:, :3, :3])[:, None]
        reach_m = rng.uniform(0.3, 1.5, (_POSES, 1)) * self.mesh.radius_m
        T[:, :3, 3] = reach_m * directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return T

    def figures(self, hierarchy: Hierarchy) -> HierarchyFigures:
        bvh = self.mesh.bvh(
            hierarchy.k, hierarchy.branching_factor, slabs=hierarchy.slabs, traversal=hierarchy.traversal
        )
        return HierarchyFigures(self._query_s(bvh), bvh.nbytes)

    def _query_s(self, bvh: MeshBvh) -> float:
        seconds = []
        for _ in range(_REPEATS):
            started = clock_s()
            collide(bvh, bvh, self.poses)
            seconds.append(clock_s() - started)
        return median(seconds) / _POSES
