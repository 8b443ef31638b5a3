"""Robots against voxels that are a million times smaller or larger than their triangles; Coal's octree beside."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from typing import Any

import numpy as np
import rayvox
from numpy.typing import NDArray
from rayvox.robot import Link, LinkGeometry, Robot

from benchmarks.collision_configurations import random_rotations
from benchmarks.extreme_cases.case import Case, Outcome, PeerOutcome
from benchmarks.extreme_cases.meshes import needle_corners, random_corners
from tests.support.triangle_cubes import gaps

FloatArray = NDArray[np.float64]
_POSES = 80


class Placed:
    """Triangles of a size at poses, and for each pose a map of one voxel that is touched or just missed."""

    def __init__(self, corners: FloatArray, size_m: float, voxel_m: float) -> None:
        rng = np.random.default_rng(21)
        # Around the origin, for an octree reaches only a million voxels far.
        self.corners, self.resolution_m = (corners - corners.mean(axis=(0, 1))) * size_m, voxel_m
        self.poses = np.tile(np.eye(4), (_POSES, 1, 1))
        self.poses[:, :3, :3] = random_rotations(rng, _POSES)
        self.poses[:, :3, 3] = rng.uniform(-0.1, 0.1, (_POSES, 3)) * max(size_m, voxel_m)
        moved = np.einsum("nij,tkj->ntki", self.poses[:, :3, :3], self.corners) + self.poses[:, None, None, :3, 3]
        weights = rng.dirichlet(np.ones(3), _POSES)
        chosen = moved[np.arange(_POSES), rng.integers(len(corners), size=_POSES)]
        at = np.einsum("nk,nkx->nx", weights, chosen) + rng.normal(0, 0.6, (_POSES, 3)) * voxel_m
        self.cells = np.floor(at / voxel_m)
        centres = (self.cells + 0.5) * voxel_m
        # In units in which the triangles have the size 1: the oracle leaves out axes that are short.
        gap = [
            gaps(m / size_m, c[None] / size_m, np.full(1, voxel_m / size_m / 2)).min()
            for m, c in zip(moved, centres, strict=True)
        ]
        self.collides = np.array(gap) <= 0
        self.decided = np.abs(gap) > 1e-12 * max(1.0, voxel_m / size_m)
        share = self.collides[self.decided].mean()
        assert 0.05 < share < 0.95, share

    def wrong(self, verdicts: NDArray[np.bool_]) -> int:
        return int((verdicts != self.collides)[self.decided].sum())


def ours(load: Callable[[], Placed]) -> Outcome:
    given = load()
    count = 3 * len(given.corners)
    mesh = rayvox.TriangleMesh(given.corners.reshape(-1, 3), np.arange(count, dtype=np.int32).reshape(-1, 3))
    robot = Robot("triangles", [Link("body", (LinkGeometry("mesh", mesh),))], [])
    verdicts = []
    for cell, pose in zip(given.cells, given.poses, strict=True):
        occupancy_map = rayvox.OccupancyMap(given.resolution_m, depth=21)
        point = (cell + 0.5) * given.resolution_m
        occupancy_map.insert_scan(point[None], origin=tuple(point.tolist()))
        checker = rayvox.CollisionChecker(occupancy_map.snapshot(), robot)
        verdicts.append(checker.check(T_map_base=pose).verdicts[0] == rayvox.CollisionVerdict.OCCUPIED)
    return Outcome(int(given.decided.sum()), given.wrong(np.array(verdicts)))


def coals(load: Callable[[], Placed]) -> PeerOutcome:
    if importlib.util.find_spec("coal") is None:
        return "not installed"
    import coal

    given = load()
    request = coal.CollisionRequest()
    request.break_distance = 0.0
    model = coal.BVHModelOBB()
    model.beginModel(len(given.corners), 3 * len(given.corners))
    for corners in given.corners:
        model.addTriangle(*corners)
    model.endModel()

    def verdict(cell: FloatArray, pose: FloatArray) -> bool:
        tree: Any = coal.makeOctree((cell[None] + 0.5) * given.resolution_m, given.resolution_m)
        placed = coal.Transform3s(pose[:3, :3].copy(), pose[:3, 3].copy())
        return bool(coal.collide(model, placed, tree, coal.Transform3s(), request, coal.CollisionResult()) > 0)

    verdicts = np.array([verdict(cell, pose) for cell, pose in zip(given.cells, given.poses, strict=True)])
    return Outcome(int(given.decided.sum()), given.wrong(verdicts))


def _triangles(needles: bool) -> FloatArray:
    rng = np.random.default_rng(22)
    return needle_corners(rng, 3, 1e6) * 0.6 if needles else random_corners(rng, 3)


def cases() -> list[Case]:
    """Ratios of triangles to voxels from a million to a millionth."""
    found = []
    sizes = [(1000.0, 1e-3), (100.0, 1e-4), (1.0, 1.0), (1e-3, 1e3), (1e-4, 100.0)]
    for size_m, voxel_m in sizes:
        for needles in (False, True):
            kind = "needles" if needles else "triangles"
            name = f"{kind} of {size_m:g} m, voxels of {voxel_m:g} m"

            def load(needles: bool = needles, size_m: float = size_m, voxel_m: float = voxel_m) -> Placed:
                return Placed(_triangles(needles), size_m, voxel_m)

            peers = {"Coal": lambda load=load: coals(load)}
            must = "no wrong verdict of a robot against a voxel"
            found.append(Case("triangles and voxels", name, must, lambda load=load: ours(load), peers=peers))
    return found
