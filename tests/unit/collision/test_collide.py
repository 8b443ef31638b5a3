"""Meshes, their hierarchies and collision queries through the Python API."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import numpy as np
import pytest
import rayvox
from numpy.typing import NDArray
from rayvox.errors import InvalidInputError

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=np.float64) - 0.5
FACES = np.array(
    [
        *([0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]),
        *([2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]),
    ]
)


def cube(size: float = 1.0) -> rayvox.CollisionMesh:
    return rayvox.CollisionMesh(CORNERS * size, FACES)


def shifted(*offsets: tuple[float, float, float]) -> NDArray[np.float64]:
    poses = np.tile(np.eye(4), (len(offsets), 1, 1))
    poses[:, :3, 3] = offsets
    return poses


def bumpy_sphere(triangles: int) -> rayvox.CollisionMesh:
    rows = int((triangles / 2) ** 0.5)
    theta, phi = np.meshgrid(
        np.linspace(0.01, np.pi - 0.01, rows + 1), np.linspace(0, 2 * np.pi, rows + 1), indexing="ij"
    )
    radius = 1 + 0.05 * np.sin(9 * theta) * np.cos(7 * phi)
    points = radius[..., None] * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    at = np.arange((rows + 1) ** 2).reshape(rows + 1, rows + 1)
    a, b, c, d = at[:-1, :-1].ravel(), at[1:, :-1].ravel(), at[1:, 1:].ravel(), at[:-1, 1:].ravel()
    return rayvox.CollisionMesh(points.reshape(-1, 3), np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]))


def test_a_batch_of_poses_gives_a_verdict_each() -> None:
    bvh = cube().bvh()
    verdicts = rayvox.collide(bvh, bvh, shifted((0, 0, 0), (1, 0, 0), (1.0000001, 0, 0), (9, 9, 9)))
    assert verdicts.dtype == np.bool_
    assert verdicts.tolist() == [True, True, False, False]
    assert rayvox.collide(bvh, bvh).tolist() == [True]
    assert rayvox.collide(bvh, bvh, np.empty((0, 4, 4))).tolist() == []


def test_contacts_name_pose_and_triangles() -> None:
    a, b = cube().bvh(), cube(0.1).bvh()
    poses = shifted((3, 0, 0), (0.5, 0, 0), (0, 0, 0))
    found = rayvox.collide(a, b, poses, contacts=True)
    assert found.colliding.tolist() == [False, True, True]
    assert found.contained.tolist() == [False, False, True]
    assert set(found.pose.tolist()) == {1}
    assert set(found.triangles[:, 0].tolist()) <= {2, 3}  # the face at x = 0.5
    assert found.statistics.triangle_pairs[1] > 0
    first = rayvox.collide(a, b, poses, contacts="first")
    assert len(first.pose) == 1
    assert first.triangles[0].tolist() in found.triangles.tolist()
    assert rayvox.collide(a, b, poses, solids=False).tolist() == [False, True, False]


def test_every_construction_and_option_gives_the_same_verdicts() -> None:
    mesh = bumpy_sphere(3000)
    rng = np.random.default_rng(1)
    poses = shifted(*(rng.normal(size=(200, 3)) * 1.2))
    expected = rayvox.collide(mesh.bvh(), mesh.bvh(), poses)
    assert 20 < expected.sum() < 180
    for construction in ("bng", "longest_axis", "extended_longest_axis"):
        for traversal, factor in (("hybrid", 16), ("1vs16", 8), ("4vs4", 4), ("simd_binary", 2), ("binary", 2)):
            bvh = mesh.bvh(construction=construction, traversal=traversal, branching_factor=factor)  # type: ignore[arg-type]
            assert (rayvox.collide(bvh, bvh, poses) == expected).all()
    for options in ({"construction": "sah", "branching_factor": 2}, {"axes": np.eye(3)}, {"k": 6, "leaf_size": 1}):
        bvh = mesh.bvh(**options)  # type: ignore[arg-type]
        assert (rayvox.collide(bvh, bvh, poses) == expected).all()
    assert mesh.bvh(axes=np.eye(3)).k == 6


def test_a_million_triangles_build() -> None:
    mesh = bumpy_sphere(1_000_000)
    bvh = mesh.bvh()
    assert mesh.triangle_count > 990_000
    assert bvh.depth < 12
    assert rayvox.collide(bvh, bvh, shifted((0, 0, 1.5), (0, 0, 3))).tolist() == [True, False]


def test_queries_let_other_threads_run() -> None:
    bvh = bumpy_sphere(20_000).bvh()
    poses = shifted(*([(0.0, 0.0, 0.01)] * 50))
    ticks = []
    done = threading.Event()

    def tick() -> None:
        while not done.is_set():
            ticks.append(time.perf_counter())
            time.sleep(0.001)

    ticker = threading.Thread(target=tick)
    ticker.start()
    start = time.perf_counter()
    rayvox.collide(bvh, bvh, poses, contacts=True)
    end = time.perf_counter()
    done.set()
    ticker.join()
    assert any(start < moment < end for moment in ticks)


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (CORNERS, np.zeros((0, 3), dtype=int), "at least one triangle"),
        (CORNERS, [[0, 1, 8]], r"triangles\[0\]\[2\] is 8"),
        (CORNERS, [[0, 1, -1]], r"triangles\[0\]\[2\] is -1"),
        (CORNERS * np.nan, FACES, r"vertices\[0\]\[0\] is"),
        (CORNERS, FACES.astype(float), "integers"),
        (CORNERS[:, :2], FACES, r"\(n, 3\)"),
    ],
)
def test_bad_meshes_are_refused(vertices: object, triangles: object, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        rayvox.CollisionMesh(vertices, triangles)  # type: ignore[arg-type]


def test_bad_options_and_poses_are_refused() -> None:
    mesh = cube()
    for options in ({"k": 7}, {"branching_factor": 5}, {"traversal": "dfs"}, {"construction": "x"}, {"slabs": "f8"}):
        with pytest.raises(InvalidInputError):
            mesh.bvh(**options)  # type: ignore[arg-type]
    with pytest.raises(InvalidInputError, match=r"T_a_b\[1\]"):
        rayvox.collide(mesh.bvh(), mesh.bvh(), np.stack([np.eye(4), 2 * np.eye(4)]))
    with pytest.raises(InvalidInputError, match=r"\(n, 4, 4\)"):
        rayvox.collide(mesh.bvh(), mesh.bvh(), np.eye(3))
    with pytest.raises(InvalidInputError, match="different traversals"):
        rayvox.collide(mesh.bvh(), mesh.bvh(traversal="1vs16"))


def test_a_mesh_file_is_read_in_metres(tmp_path: Path) -> None:
    file = tmp_path / "corner.obj"
    file.write_text("v 0 0 0\nv 1000 0 0\nv 0 1000 0\nv 0 0 1000\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    mesh = rayvox.CollisionMesh.from_file(file, scale=0.001)
    assert mesh.triangle_count == 4
    assert mesh.is_closed
    assert mesh.radius_m == pytest.approx(np.sqrt(0.75))
    with pytest.raises(rayvox.InvalidInputError, match="scale"):
        rayvox.CollisionMesh.from_file(file, scale=0.0)
