"""Boxes, cylinders and spheres as triangles that contain them."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from rayvox.mesh_io import TriangleMesh

# How far a tessellation may reach beyond its shape, unless that takes more than MOST_SIDES.
EXCESS_M = 1e-3
LEAST_SIDES, MOST_SIDES = 16, 128
_MOST_SUBDIVISIONS = 4
# Lifts the surface off rounding: a vertex is off by at most this fraction.
_ROUNDING = 1e-12


def box_mesh(size_m: tuple[float, float, float]) -> TriangleMesh:
    """A box about the origin, exactly."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    return TriangleMesh(corners * size_m, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32))


def cylinder_mesh(radius_m: float, length_m: float) -> tuple[TriangleMesh, float]:
    """A prism around a cylinder about z, and by how much it reaches beyond it."""
    # The sides touch the circle, so the corners lie at radius / cos(pi / n).
    n = LEAST_SIDES
    while n < MOST_SIDES and radius_m * (1 / math.cos(math.pi / n) - 1) > EXCESS_M:
        n += 8
    outer = radius_m / math.cos(math.pi / n) * (1 + _ROUNDING)
    angles = 2 * math.pi * np.arange(n) / n
    ring = np.stack([outer * np.cos(angles), outer * np.sin(angles)], axis=1)
    half = length_m / 2
    vertices = np.vstack(
        [np.column_stack([ring, np.full(n, -half)]), np.column_stack([ring, np.full(n, half)]), _poles(half)]
    )
    i, j = np.arange(n), (np.arange(n) + 1) % n
    bottom, top = np.full(n, 2 * n), np.full(n, 2 * n + 1)
    columns = [(i, j, n + j), (i, n + j, n + i), (j, i, bottom), (n + i, n + j, top)]
    triangles = np.concatenate([np.stack(column, axis=1) for column in columns])
    return TriangleMesh(vertices, triangles.astype(np.int32)), outer - radius_m


def sphere_mesh(radius_m: float) -> tuple[TriangleMesh, float]:
    """A polyhedron around a sphere about the origin, and by how much it reaches beyond it."""
    vertices, triangles = _icosahedron()
    for level in range(1, _MOST_SUBDIVISIONS + 1):
        vertices, triangles = _subdivided(vertices, triangles)
        # Grown until the nearest facet touches the sphere.
        a, b, c = vertices[triangles].transpose(1, 0, 2)
        normals = np.cross(b - a, c - a)
        nearest = np.min(np.einsum("ij,ij->i", a, normals) / np.linalg.norm(normals, axis=1))
        outer = radius_m / nearest * (1 + _ROUNDING)
        if level > 1 and outer - radius_m <= EXCESS_M:
            break
    return TriangleMesh(vertices * outer, triangles.astype(np.int32)), outer - radius_m


def _poles(half: float) -> npt.NDArray[np.float64]:
    return np.array([[0.0, 0.0, -half], [0.0, 0.0, half]])


def _icosahedron() -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    g = (1 + math.sqrt(5)) / 2
    corners = [(s * 1.0, t * g) for s in (-1, 1) for t in (-1, 1)]
    vertices = np.array([np.roll((0.0, a, b), k) for k in range(3) for a, b in corners])
    distances = np.linalg.norm(vertices[:, None] - vertices[None], axis=2)
    near = np.abs(distances - 2.0) < 1e-9
    triangles = np.array(
        [(i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]]
    )
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return vertices / np.linalg.norm(vertices[0]), triangles


def _subdivided(
    vertices: npt.NDArray[np.float64], triangles: npt.NDArray[np.int64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """Each triangle into four, new vertices on the unit sphere."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middles = vertices[unique].sum(axis=1)
    middles /= np.linalg.norm(middles, axis=1, keepdims=True)
    ab, bc, ca = (inverse.reshape(-1, 3) + len(vertices)).T
    a, b, c = triangles.T
    divided = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.vstack([vertices, middles]), np.concatenate([np.stack(t, axis=1) for t in divided])
