"""Distances, sides and levels of detail against brute force and against shapes with a formula."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rayvox import _native
from rayvox.errors import InvalidInputError
from rayvox.mesh_io import TriangleMesh, read_mesh
from rayvox.robot import BodyFilter, Link, LinkGeometry, Robot, ScanPoint, simplified
from rayvox.robot.primitives import box_mesh, cylinder_mesh, sphere_mesh

from tests.support.datasets import data_path
from tests.support.robots import arm_archive, real_robot

FloatArray = npt.NDArray[np.float64]


def tree_of(mesh: TriangleMesh) -> _native.TriangleTree:
    return _native.TriangleTree(mesh.vertices, mesh.triangles)


def surface_points(mesh: TriangleMesh, count: int, rng: np.random.Generator) -> FloatArray:
    """Points spread over random triangles, and these triangles' corners."""
    corners = mesh.corners()[rng.integers(len(mesh), size=count)]
    weights = rng.dirichlet([0.5, 0.5, 0.5], count)
    return np.concatenate([np.einsum("nk,nkd->nd", weights, corners), corners.reshape(-1, 3)])


def grid_points(mesh: TriangleMesh, steps: int) -> FloatArray:
    """Points on a regular grid over every triangle, corners and edges among them."""
    i, j = (index.ravel() for index in np.mgrid[0 : steps + 1, 0 : steps + 1])
    weights = np.stack([i, j, steps - i - j], axis=1)[i + j <= steps] / steps
    points: FloatArray = np.einsum("wk,nkd->nwd", weights, mesh.corners()).reshape(-1, 3)
    return points


def winding_inside(mesh: TriangleMesh, points: FloatArray) -> npt.NDArray[np.bool_]:
    """By the solid angle of all triangles (van Oosterom, Strackee 1983)."""
    a, b, c = (mesh.corners()[None, :, k] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(v, axis=2) for v in (a, b, c))
    above = np.einsum("npd,npd->np", a, np.cross(b, c))
    dots = [np.einsum("npd,npd->np", u, v) for u, v in ((a, b), (b, c), (c, a))]
    below = la * lb * lc + dots[0] * lc + dots[1] * la + dots[2] * lb
    turns: FloatArray = np.arctan2(above, below).sum(axis=1) / (2 * np.pi)
    return np.abs(turns) > 0.5


def shifted(mesh: TriangleMesh) -> TriangleMesh:
    return TriangleMesh(mesh.vertices + np.array([0.5, 0.2, 0.1]), mesh.triangles)


SOLIDS = {
    "box": box_mesh((0.4, 1.0, 0.2)),
    "cylinder": cylinder_mesh(0.3, 1.0)[0],
    "sphere": sphere_mesh(0.5)[0],
    "two boxes that overlap": TriangleMesh.concatenate([box_mesh((1, 1, 1)), shifted(box_mesh((1, 1, 1)))]),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_inside_is_where_the_surface_winds_around(name: str) -> None:
    mesh = SOLIDS[name]
    rng = np.random.default_rng(4)
    points = rng.uniform(-0.8, 1.2, (800, 3))
    # Straight below and beside corners and edges, where crossings are easily counted twice or not at all.
    points[:400] = mesh.vertices[rng.integers(len(mesh.vertices), size=400)]
    points[:400, 0] += rng.uniform(-0.5, 0.5, 400)
    points = points[tree_of(mesh).distances(points) > 1e-9]
    np.testing.assert_array_equal(tree_of(mesh).inside(points), winding_inside(mesh, points))


def test_an_open_mesh_has_no_inside() -> None:
    box = box_mesh((1, 1, 1))
    opened = TriangleMesh(box.vertices, box.triangles[1:])
    assert not tree_of(opened).inside(np.zeros((1, 3))).any()
    assert tree_of(box).inside(np.zeros((1, 3))).all()


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_a_level_of_detail_never_misses_more_than_it_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bumpy = sphere_mesh(0.05)[0].scaled(20.0)
    bumps = 1 + 0.1 * np.sin(rng.uniform(1, 8) * bumpy.vertices @ rng.normal(size=3))
    mesh = TriangleMesh(bumpy.vertices * bumps[:, None] + rng.uniform(-100, 100, 3), bumpy.triangles)
    error_m = 10 ** rng.uniform(-3, -0.5)
    level = simplified(mesh, error_m)
    assert level.error_m <= error_m
    assert len(level.mesh) <= len(mesh)
    missed = tree_of(level.mesh).distances(grid_points(mesh, 6)).max()
    assert missed <= level.error_m + 1e-12
    # Proven is not the same as loose.
    assert level.error_m <= missed + 0.3 * error_m


@pytest.mark.parametrize(
    ("name", "error_m", "most_triangles"),
    [
        ("robots/panda/meshes/visual/link0.dae", 0.005, 3000),
        ("robots/anymal_c/meshes/top_shell.dae", 0.0125, 500),
        ("mesh_robustness/soup.stl", 0.01, 100),
    ],
)
def test_levels_of_detail_of_real_meshes_hold_and_are_small(name: str, error_m: float, most_triangles: int) -> None:
    mesh = read_mesh(data_path(name))
    level = simplified(mesh, error_m)
    assert len(level.mesh) <= most_triangles
    missed = tree_of(level.mesh).distances(surface_points(mesh, 5_000, np.random.default_rng(0))).max()
    assert missed <= level.error_m + 1e-12 <= error_m + 1e-12


def test_no_error_allowed_means_no_change() -> None:
    mesh = sphere_mesh(1.0)[0]
    assert simplified(mesh, 0.0).mesh is mesh
    assert len(simplified(box_mesh((1, 1, 1)), 0.5).mesh) == 12
    for wrong in (-1.0, float("nan"), float("inf")):
        with pytest.raises(InvalidInputError):
            simplified(mesh, wrong)


def test_the_deviation_is_that_of_shapes_with_a_formula() -> None:
    box, larger = box_mesh((1, 1, 1)), box_mesh((1.2, 1.2, 1.2))
    # From each face of the inner box it is 0.1 outward; from the outer box's corners sqrt(3) times as far inward.
    for original, onto, wanted in ((box, larger, 0.1), (larger, box, 0.1 * 3**0.5)):
        bound = tree_of(onto).deviation_of(original.vertices, original.triangles, 0.2)
        assert wanted - 1e-12 <= bound <= wanted * 1.05 + 0.02
        assert tree_of(onto).deviation_of(original.vertices, original.triangles, 0.99 * wanted) == np.inf


BALL = Robot("ball", [Link("ball", (LinkGeometry("sphere", sphere_mesh(0.5)[0]),))], [])


def test_points_on_the_body_and_behind_it_are_told_apart() -> None:
    body = BodyFilter(BALL.with_padding(0.1))
    points = [[0, 0, 0], [0.55, 0, 0], [0.7, 0, 0], [-3, 0, 0], [3, 3, 0], [-3, 1.5, 0]]
    kinds = body.classify(points, T_base_sensor=None, origin=(3.0, 0, 0))
    kept, on, behind = ScanPoint.KEPT, ScanPoint.ON_BODY, ScanPoint.BEHIND_BODY
    assert kinds.tolist() == [on, on, kept, behind, kept, kept]
    # A sensor on the body's surface is not blinded by it.
    assert body.classify([[-3.0, 0, 0], [0, 0, 0]], origin=(0.5, 0, 0)).tolist() == [kept, on]


def held_by(tree: _native.TriangleTree, points: FloatArray, padding_m: float = 0.03) -> npt.NDArray[np.bool_]:
    return (tree.distances(points) <= padding_m) | tree.inside(points)


@settings(deadline=None, max_examples=15)
@given(st.integers(0, 2**32 - 1))
def test_the_body_filter_is_what_brute_force_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = Robot.from_archive(arm_archive()).with_padding(0.03)
    q = robot.sample_configurations(1, rng)[0]
    T_base_sensor = robot.link_poses(q)[0, robot.link_index("hand")]
    points = rng.uniform(-0.8, 0.8, (120, 3)).astype(np.float32)
    kinds = BodyFilter(robot).classify(points, q, T_base_sensor)
    on, behind = np.zeros(120, bool), np.zeros(120, bool)
    in_base = points.astype(np.float64) @ T_base_sensor[:3, :3].T + T_base_sensor[:3, 3]
    for link, T in zip(robot.links, robot.link_poses(q)[0], strict=True):
        if not link.geometries:
            continue
        tree = tree_of(link.mesh.transformed(T))
        on |= held_by(tree, in_base)
        if not held_by(tree, T_base_sensor[None, :3, 3])[0]:
            steps = np.linspace(0, 1, 150)[:, None, None]
            along = T_base_sensor[:3, 3] + steps * (in_base - T_base_sensor[:3, 3])
            behind |= (tree.distances(along.reshape(-1, 3)).reshape(150, 120) <= 0.03).any(axis=0)
    np.testing.assert_array_equal(kinds == ScanPoint.ON_BODY, on)
    # Samples along a ray may miss a touch that is there, never find one that is not.
    assert (kinds[behind & ~on] == ScanPoint.BEHIND_BODY).all()
    assert ((kinds == ScanPoint.BEHIND_BODY) & ~behind).sum() <= 4


def test_a_scan_of_a_real_robots_own_body_is_dropped() -> None:
    robot = Robot.from_urdf(real_robot("panda")).with_padding(0.01)
    rng = np.random.default_rng(0)
    q = robot.sample_configurations(1, rng)[0]
    poses = robot.link_poses(q)[0]
    body = np.concatenate(
        [
            surface_points(link.mesh, 200, rng) @ T[:3, :3].T + T[:3, 3]
            for link, T in zip(robot.links, poses, strict=True)
            if link.geometries
        ]
    )
    noisy = body + rng.uniform(-0.005, 0.005, body.shape)
    sensor = np.eye(4)
    sensor[:3, 3] = [2.0, 0, 1.0]
    kinds = BodyFilter(robot).classify(noisy - sensor[:3, 3], q, sensor)
    assert (kinds == ScanPoint.ON_BODY).all()
