"""Small random and adversarial rays and rooms, reproducible from a seed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def random_rays(
    rng: np.random.Generator, count: int, extent_m: float, centre_m: float = 0.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Origins and ends (n,3), uniform in a cube of half-edge `extent_m` around `centre_m`."""
    rays = rng.uniform(-extent_m, extent_m, (2, count, 3)) + centre_m
    return rays[0], rays[1]


def lattice_rays(
    rng: np.random.Generator, count: int, resolution_m: float, reach: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rays between half-cell lattice points: corners, edges, faces, diagonals, zero lengths, axis-parallel ones."""
    rays = rng.integers(-2 * reach, 2 * reach + 1, (2, count, 3)) / 2.0
    axis_parallel = rng.random(count) < 0.3
    keep = rng.integers(0, 3, count)
    for axis in range(3):
        frozen = axis_parallel & (keep != axis)
        rays[1, frozen, axis] = rays[0, frozen, axis]
    diagonal = rng.random(count) < 0.2
    steps = rng.choice([-1.0, 1.0], (count, 3)) * rng.integers(0, reach, (count, 1))
    rays[1, diagonal] = rays[0, diagonal] + steps[diagonal]
    return rays[0] * resolution_m, rays[1] * resolution_m


def room_scan(
    rng: np.random.Generator, count: int, half_m: float, origin_m: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Points (n,3) float32 where random rays from `origin_m` meet the walls of a cube with a pillar in it."""
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    with np.errstate(divide="ignore"):
        to_wall = ((np.sign(directions) * half_m - origin_m) / directions).min(axis=1)
    pillar = np.array([half_m * 0.5, half_m * 0.3, 0.0])
    offset = (origin_m - pillar)[:2]
    a = (directions[:, :2] ** 2).sum(axis=1)
    b = directions[:, :2] @ offset
    c = offset @ offset - (half_m * 0.1) ** 2
    disc = b * b - a * c
    to_pillar = np.where(disc > 0, (-b - np.sqrt(np.maximum(disc, 0))) / a, np.inf)
    reach = np.where(to_pillar > 0, np.minimum(to_wall, to_pillar), to_wall)
    points: NDArray[np.float32] = (origin_m + directions * reach[:, None]).astype(np.float32)
    return points
