"""Robots: shapes that contain what they stand for, what may touch, attached objects, padding."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rayvox.errors import InvalidInputError, MeshFormatError
from rayvox.mesh_io import TriangleMesh
from rayvox.robot import AllowedCollisions, Robot
from rayvox.robot.bounding_capsule import bounding_capsule
from rayvox.robot.primitives import box_mesh, cylinder_mesh, sphere_mesh

from tests.support.mesh_files import CUBE_TRIANGLES, CUBE_VERTICES, stl_binary
from tests.support.robots import REAL_ROBOTS, arm_archive, real_robot, zipped

CUBE = TriangleMesh(CUBE_VERTICES - 0.5, CUBE_TRIANGLES)


@pytest.fixture
def arm() -> Robot:
    return Robot.from_archive(arm_archive())


def least_support(mesh: TriangleMesh, directions: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """How far the mesh's convex hull reaches along each direction."""
    support: npt.NDArray[np.float64] = (directions @ mesh.vertices.T).max(axis=1)
    return support


def facet_distances(mesh: TriangleMesh) -> npt.NDArray[np.float64]:
    """Distance from the origin to each facet's plane, outward positive."""
    a, b, c = mesh.corners().transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    distances: npt.NDArray[np.float64] = np.einsum("ij,ij->i", a, normals) / np.linalg.norm(normals, axis=1)
    return distances


@pytest.mark.parametrize("radius", [1e-4, 0.01, 0.05, 0.5, 3.0])
def test_spheres_and_cylinders_are_contained_with_the_excess_told(radius: float) -> None:
    sphere, sphere_excess = sphere_mesh(radius)
    cylinder, cylinder_excess = cylinder_mesh(radius, 2 * radius)
    # Convex, and no facet cuts into the shape.
    assert facet_distances(sphere).min() >= radius
    assert facet_distances(cylinder).min() >= radius * (1 - 1e-15)
    assert np.linalg.norm(sphere.vertices, axis=1).max() <= radius + sphere_excess + 1e-15
    assert np.linalg.norm(cylinder.vertices[:, :2], axis=1).max() <= radius + cylinder_excess + 1e-15
    assert np.abs(cylinder.vertices[:, 2]).max() == radius
    for mesh, excess in ((sphere, sphere_excess), (cylinder, cylinder_excess)):
        assert 0 < excess <= max(1e-3, 0.004 * radius)
        assert mesh.parts().closed.tolist() == [True]


def test_a_box_is_exact() -> None:
    np.testing.assert_allclose(box_mesh((1, 2, 3)).bounds_m, ([-0.5, -1, -1.5], [0.5, 1, 1.5]))
    assert box_mesh((1, 2, 3)).parts().closed.tolist() == [True]
    assert facet_distances(box_mesh((1, 2, 3))).min() == 0.5


@settings(deadline=None, max_examples=200)
@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.floats(-6, 6))
def test_a_capsule_holds_all_its_points(seed: int, count: int, exponent: float) -> None:
    rng = np.random.default_rng(seed)
    points = (rng.normal(size=(count, 3)) * 10.0 ** rng.uniform(-3, 1, 3) + rng.normal(size=3)) * 10.0**exponent
    capsule = bounding_capsule(points)
    along = capsule[3:6] - capsule[:3]
    t = np.clip((points - capsule[:3]) @ along / max(along @ along, 1e-300), 0, 1)
    assert (np.linalg.norm(points - capsule[:3] - t[:, None] * along, axis=1) <= capsule[6]).all()
    # No wider than the ball around the middle of the points' box.
    ball = np.linalg.norm(points - (points.min(axis=0) + points.max(axis=0)) / 2, axis=1).max()
    assert capsule[6] <= ball + 1e-6 * np.abs(points).max()


def test_links_that_a_joint_joins_or_that_never_move_apart_may_touch(arm: Robot) -> None:
    allowed = arm.allowed_collisions
    for pair in (("base", "column"), ("column", "lift"), ("lift", "mount"), ("hand", "left"), ("hand", "right")):
        assert allowed.allows(*pair), pair
    assert allowed.allows("lift", "upper")  # by a joint on a link without geometry
    for pair in (("base", "lift"), ("left", "right"), ("upper", "left"), ("base", "hand")):
        assert not allowed.allows(*pair), pair
    assert ("mount", "mount") not in [(arm.link_names[i], arm.link_names[j]) for i, j in arm.self_collision_pairs()]


def test_allowed_collisions_can_be_edited(arm: Robot) -> None:
    edited = arm.allowed_collisions.with_allowed([("left", "right")]).with_forbidden([("base", "column")])
    assert edited.allows("right", "left")
    assert not edited.allows("column", "base")
    pairs = {
        (arm.link_names[i], arm.link_names[j]) for i, j in arm.with_allowed_collisions(edited).self_collision_pairs()
    }
    assert ("base", "column") in pairs
    assert ("left", "right") not in pairs
    with pytest.raises(InvalidInputError, match="no link 'x'"):
        edited.with_allowed([("x", "left")])
    with pytest.raises(InvalidInputError, match="symmetric"):
        AllowedCollisions(("a", "b"), np.array([[True, True], [False, True]]))


def test_pairs_that_always_touch_are_found_by_sampling(arm: Robot) -> None:
    asked: list[tuple[int, ...]] = []

    def touches(
        robot: Robot, configurations: npt.NDArray[np.float64], pairs: npt.NDArray[np.intp]
    ) -> npt.NDArray[np.bool_]:
        asked.append(configurations.shape)
        assert (configurations >= np.maximum(robot.limits[0], -np.pi)).all()
        assert (configurations <= np.minimum(robot.limits[1], np.pi)).all()
        always = {robot.link_index("left"), robot.link_index("right")}
        found = np.array([[set(pair) == always for pair in pairs.tolist()]] * len(configurations))
        found[::2] |= pairs[:, 0] == 0  # the base touches half of the time
        return found

    robot = arm.with_always_touching_allowed(touches, samples=100)
    assert asked == [(100, 5)]
    assert robot.allowed_collisions.allows("left", "right")
    assert not robot.allowed_collisions.allows("base", "hand")


def test_pairs_whose_meshes_always_overlap_may_touch_once_a_robot_is_loaded() -> None:
    # Two hinges in a row; the first and the last link are longer than the one between them.
    def link(name: str, length_m: float) -> str:
        geometry = f'<geometry><box size="{length_m} 0.1 0.1"/></geometry>'
        return f'<link name="{name}"><collision>{geometry}</collision></link>'

    def hinge(parent: str, child: str, x: float) -> str:
        ends = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{x} 0 0"/><axis xyz="0 0 1"/>'
        return f'<joint name="{child}" type="revolute">{ends}<limit lower="-1" upper="1"/></joint>'

    chain = link("a", 1) + link("b", 0.1) + link("c", 1) + link("d", 0.1)
    joints = hinge("a", "b", 0.2) + hinge("b", "c", 0.0) + hinge("c", "d", 2.0)
    robot = Robot.from_archive(zipped({"chain.urdf": f'<robot name="chain">{chain}{joints}</robot>'}))
    assert robot.allowed_collisions.allows("a", "c")
    assert not robot.allowed_collisions.allows("a", "d")


def test_an_attached_object_comes_last_whatever_its_link(arm: Robot) -> None:
    held = arm.with_attached("box", CUBE.scaled(0.05), "column").with_attached("ball", CUBE.scaled(0.05), "base")
    assert held.link_names == (*arm.link_names, "box", "ball")


def test_an_attached_object_moves_with_its_link(arm: Robot) -> None:
    grasp = np.eye(4)
    grasp[:3, 3] = [0.1, 0, 0]
    held = arm.with_attached("box", CUBE.scaled(0.05), "hand", grasp, touch_links=["left"])
    q = arm.sample_configurations(5, np.random.default_rng(0))
    poses = held.link_poses(q)
    np.testing.assert_allclose(poses[:, held.link_index("box")], poses[:, held.link_index("hand")] @ grasp, atol=1e-12)
    allows = held.allowed_collisions.allows
    assert allows("box", "hand")
    assert allows("box", "left")
    assert not allows("box", "right")
    assert held.joint_names == arm.joint_names
    assert held.without_attached("box").link_names == arm.link_names
    with pytest.raises(InvalidInputError, match="already"):
        held.with_attached("box", CUBE, "hand")
    with pytest.raises(InvalidInputError, match="no object"):
        held.without_attached("hand")


def test_padding_is_per_link(arm: Robot) -> None:
    padded = arm.with_padding({"hand": 0.02}).with_padding({"left": 0.01})
    assert {link.name: link.padding_m for link in padded.links if link.padding_m} == {"hand": 0.02, "left": 0.01}
    grown = padded.padded_capsules()[:, 6] - arm.padded_capsules()[:, 6]
    np.testing.assert_allclose(grown[[arm.link_index("hand"), arm.link_index("base")]], [0.02, 0])
    assert arm.with_padding(0.1).padded_capsules()[arm.link_index("mount"), 6] == -1
    for wrong in ({"x": 0.1}, {"hand": -0.1}, {"hand": float("nan")}):
        with pytest.raises(InvalidInputError):
            arm.with_padding(wrong)


def test_a_rigid_mesh_is_a_robot_without_joints(tmp_path: Path) -> None:
    path = tmp_path / "crate.stl"
    path.write_bytes(stl_binary(CUBE_VERTICES, CUBE_TRIANGLES))
    crate = Robot.from_mesh(path, scale=2, unit="cm")
    assert (crate.name, crate.joint_names, crate.triangle_count) == ("crate", (), 12)
    np.testing.assert_allclose(crate.links[0].mesh.bounds_m[1], 0.02)
    assert crate.links[0].is_closed
    poses = np.stack([np.eye(4)] * 3)
    poses[:, 0, 3] = [1, 2, 3]
    np.testing.assert_array_equal(crate.link_poses(T_map_base=poses)[:, 0], poses)
    assert crate.link_poses().shape == (1, 1, 4, 4)
    with pytest.raises(InvalidInputError, match="unit"):
        Robot.from_mesh(path, unit="furlong")
    with pytest.raises(InvalidInputError, match="scale"):
        Robot.from_mesh(path, scale=0)
    with pytest.raises(MeshFormatError, match="not 'txt'"):
        Robot.from_mesh(tmp_path / "crate.txt")


@pytest.mark.parametrize("name", REAL_ROBOTS)
def test_padded_capsules_hold_the_links_of_real_robots(name: str) -> None:
    for link in Robot.from_urdf(real_robot(name)).links:
        if link.geometries:
            start, end, radius = link.capsule[:3], link.capsule[3:6], link.capsule[6]
            along = end - start
            t = np.clip((link.mesh.vertices - start) @ along / max(along @ along, 1e-300), 0, 1)
            assert np.linalg.norm(link.mesh.vertices - start - t[:, None] * along, axis=1).max() <= radius
