"""Two meshes, placements of the second, and the true answer of each: what collision libraries are judged by.

The truth is the least gap of any pair of triangles in extended precision (tests/support/triangle_gap.py); placements
whose gap is too small for it to tell are counted apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rayvox
from numpy.typing import NDArray

from benchmarks.robot_meshes import Mesh
from tests.support.triangle_gap import mesh_gaps

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Configurations:
    """n placements (n, 4, 4) of mesh b, and whether it collides there; `decided` where the truth is known."""

    a: Mesh
    b: Mesh
    poses: FloatArray
    collides: NDArray[np.bool_]
    decided: NDArray[np.bool_]

    def wrong(self, verdicts: NDArray[np.bool_]) -> int:
        return int((verdicts != self.collides)[self.decided].sum())

    @property
    def checked(self) -> int:
        return int(self.decided.sum())


def mesh_of(corners: FloatArray, name: str = "mesh") -> Mesh:
    """From (n, 3, 3) corners."""
    return Mesh(name, corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def judged(
    a: Mesh,
    b: Mesh,
    poses: FloatArray,
    undecided_m: float,
    *,
    touching_m: float = 0.0,
    collides: bool | None = None,
) -> Configurations:
    """With the truth of every placement. `undecided_m`: smaller gaps are not told from zero.

    touching_m: smaller gaps are zero, where all coordinates lie on a grid. collides: what is known of all placements
    beforehand, for solids; the gap is then not asked.
    """
    if collides is not None:
        return Configurations(a, b, poses, np.full(len(poses), collides), np.ones(len(poses), dtype=bool))
    corners_a, corners_b = a.vertices[a.triangles], b.vertices[b.triangles]
    gaps = mesh_gaps(corners_a, corners_b, poses)
    return Configurations(a, b, poses, gaps <= touching_m, np.abs(gaps) > undecided_m)


def random_rotations(rng: np.random.Generator, count: int) -> FloatArray:
    """(count, 3, 3)."""
    q = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    rotations: FloatArray = q * np.linalg.det(q)[:, None, None]
    return rotations


def _points_on(mesh: Mesh, rng: np.random.Generator, count: int) -> FloatArray:
    weights = rng.dirichlet(np.ones(3), count)
    corners = mesh.vertices[mesh.triangles[rng.integers(len(mesh.triangles), size=count)]]
    points: FloatArray = np.einsum("nk,nkx->nx", weights, corners)
    return points


def crossing_poses(a: Mesh, b: Mesh, rng: np.random.Generator, count: int) -> FloatArray:
    """Random rotations, each with the translation that brings a point of b's surface onto one of a's."""
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = random_rotations(rng, count)
    at, point = _points_on(a, rng, count), _points_on(b, rng, count)
    poses[:, :3, 3] = at - np.einsum("nij,nj->ni", poses[:, :3, :3], point)
    return poses


def size_m(mesh: Mesh) -> float:
    """Diagonal of the box."""
    return float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))


def touching(a: Mesh, b: Mesh, rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
    """Placements (n, 4, 4) at which b stops touching a when moved along directions (n, 3)."""
    bvh_a, bvh_b = (rayvox.CollisionMesh(m.vertices, m.triangles).bvh() for m in (a, b))
    poses = crossing_poses(a, b, rng, count)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    inside, outside = np.zeros(count), np.full(count, 1.01 * (size_m(a) + size_m(b)))
    placed = poses.copy()
    for _ in range(60):
        middle = (inside + outside) / 2
        placed[:, :3, 3] = poses[:, :3, 3] + directions * middle[:, None]
        hit = rayvox.collide(bvh_a, bvh_b, placed, solids=False)
        inside, outside = np.where(hit, middle, inside), np.where(hit, outside, middle)
    poses[:, :3, 3] += directions * outside[:, None]
    return poses, directions


def near_touching(
    a: Mesh,
    b: Mesh,
    rng: np.random.Generator,
    count: int,
    offsets: Sequence[float] = (-1e-2, -1e-3, -1e-6, -1e-8, 1e-8, 1e-6, 1e-3, 1e-2),
    undecided: float = 1e-9,
) -> Configurations:
    """Placements moved by `offsets` out of touching (negative: into each other); both in parts of the larger size."""
    poses, directions = touching(a, b, rng, count)
    size = max(size_m(a), size_m(b))
    poses[:, :3, 3] += directions * np.resize(offsets, count)[:, None] * size
    found = judged(a, b, poses, undecided * size)
    share = found.collides[found.decided].mean()
    assert len(offsets) == 1 or 0.1 < share < 0.9, f"one answer is rare: {share:.2f} collide"
    return found
