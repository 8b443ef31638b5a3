"""The placements of Trenkel, Weller and Zachmann's benchmark (WSCG 2007): two copies of an object at distance zero.

Directions and rotations are spread evenly; along each direction the second copy comes in from outside until the two
are within 1e-9 of their size of touching, and stays just apart.
"""

from __future__ import annotations

import numpy as np
import rayvox
from numpy.typing import NDArray

from benchmarks.robot_meshes import Mesh

_GAP = 1e-9


def _even_rotations(count: int) -> NDArray[np.float64]:
    """Super-Fibonacci spirals (Alexa, CVPR 2022): (count, 3, 3)."""
    s = np.arange(count) + 0.5
    inner, outer = np.sqrt(s / count), np.sqrt(1 - s / count)
    alpha, beta = 2 * np.pi * s / np.sqrt(2), 2 * np.pi * s / 1.533751168755204288118041
    x, y, z, w = inner * np.sin(alpha), inner * np.cos(alpha), outer * np.sin(beta), outer * np.cos(beta)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _even_directions(count: int) -> NDArray[np.float64]:
    """A Fibonacci lattice on the sphere, (count, 3), in an order that has nothing to do with the rotations'."""
    index = (np.arange(count) * 7919) % count + 0.5
    z, angle = 1 - 2 * index / count, np.pi * (1 + 5**0.5) * index
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def touching_poses(mesh: Mesh, bvh: rayvox.MeshBvh, count: int, apart: float = 0.0) -> NDArray[np.float64]:
    """(n, 4, 4) poses of the second copy, n about `count`: a direction whose path misses is left out.

    `apart`: further away by this part of the object's radius.
    """
    centre = (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0)) / 2
    radius = float(np.linalg.norm(mesh.vertices - centre, axis=1).max())
    rotations, directions = _even_rotations(count), _even_directions(count)
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = rotations

    def collides(offset: NDArray[np.float64]) -> NDArray[np.bool_]:
        poses[:, :3, 3] = centre + directions * offset[:, None] - rotations @ centre
        return rayvox.collide(bvh, bvh, poses, solids=False)

    inside, outside = np.zeros(count), np.full(count, 2.01 * radius)
    reached = np.zeros(count, dtype=bool)
    for step in np.linspace(2.01, 0.0, 250)[1:] * radius:
        offset = np.where(reached, inside, step)
        hit = collides(offset) & ~reached
        outside = np.where(reached | hit, outside, step)
        inside, reached = np.where(hit, step, inside), reached | hit
    while (outside - inside)[reached].max() > _GAP * radius:
        middle = (inside + outside) / 2
        hit = collides(middle)
        inside, outside = np.where(hit, middle, inside), np.where(hit, outside, middle)
    outside = outside + apart * radius
    reached &= ~collides(outside)
    return poses[reached].copy()
