"""Collision verdicts against a float64 brute force: every pair of triangles, every axis that can separate them."""

from __future__ import annotations

import numpy as np
import pytest
import rayvox
from numpy.typing import NDArray

from tests.support.separating_axes import mesh_separation

# Nearer than this to touching, relative to the meshes' size of one metre, a case is counted apart.
UNDECIDED_M = 1e-9

VARIANTS = [
    ("hybrid", 16, 32, "float16"),
    ("hybrid", 8, 18, "float32"),
    ("1vs16", 16, 24, "float16"),
    ("1vs16", 16, 6, "float32"),
    ("4vs4", 4, 8, "float16"),
    ("4vs4", 4, 16, "float32"),
    ("simd_binary", 2, 14, "float32"),
    ("binary", 2, 26, "float32"),
]


def random_mesh(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """(count, 3, 3) triangles in a ball of a metre across."""
    return rng.uniform(-0.4, 0.4, (count, 1, 3)) + rng.normal(0, 0.12, (count, 3, 3))


def random_poses(rng: np.random.Generator, count: int, reach: float) -> NDArray[np.float64]:
    q = rng.normal(size=(count, 4))
    w, x, y, z = (q / np.linalg.norm(q, axis=1)[:, None]).T
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = np.moveaxis(
        np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        ),
        2,
        0,
    )
    poses[:, :3, 3] = rng.uniform(-reach, reach, (count, 3))
    return poses


def hierarchy(corners: NDArray[np.float64], variant: tuple[str, int, int, str]) -> rayvox.MeshBvh:
    traversal, branching_factor, k, slabs = variant
    mesh = rayvox.CollisionMesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    return mesh.bvh(k=k, branching_factor=branching_factor, slabs=slabs, traversal=traversal)  # type: ignore[arg-type]


def just_touching(a: rayvox.MeshBvh, b: rayvox.MeshBvh, poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """The poses with b moved along its offset to within a few 1e-9 of touching, some before it and some after."""
    direction = poses[:, :3, 3] / np.linalg.norm(poses[:, :3, 3], axis=1)[:, None]
    inside, outside = np.zeros(len(poses)), np.full(len(poses), 3.0)
    placed = poses.copy()
    for _ in range(40):
        middle = (inside + outside) / 2
        placed[:, :3, 3] = direction * middle[:, None]
        hit = rayvox.collide(a, b, placed, solids=False)
        inside, outside = np.where(hit, middle, inside), np.where(hit, outside, middle)
    offsets = np.resize([-1e-6, -1e-8, -2e-9, 0.0, 2e-9, 1e-8, 1e-6], len(poses))
    placed[:, :3, 3] = direction * (outside + offsets)[:, None]
    return placed


@pytest.mark.parametrize("seed", range(5))
def test_no_verdict_is_wrong_at_random_and_at_nearly_touching_poses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    decided = touching = 0
    for _ in range(4):
        corners_a, corners_b = random_mesh(rng, int(rng.integers(1, 9))), random_mesh(rng, int(rng.integers(1, 9)))
        poses = random_poses(rng, 250, 0.8)
        reference = [hierarchy(corners, VARIANTS[0]) for corners in (corners_a, corners_b)]
        poses = np.concatenate([poses, just_touching(*reference, poses)])
        gap = mesh_separation(corners_a, corners_b, poses)
        clear = np.abs(gap) > UNDECIDED_M
        decided += int(clear.sum())
        touching += int((gap[clear] <= 0).sum())
        for variant in VARIANTS:
            verdict = rayvox.collide(hierarchy(corners_a, variant), hierarchy(corners_b, variant), poses, solids=False)
            np.testing.assert_array_equal(verdict[clear], gap[clear] <= 0, err_msg=str(variant))
    assert decided > 1500
    assert 80 < touching < decided - 80
