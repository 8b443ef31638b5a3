"""Forward kinematics and motion bounds against plain matrix products, another library, and sampled points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rayvox.errors import InvalidInputError
from rayvox.mesh_io import TriangleMesh
from rayvox.robot import Joint, JointMotion, Link, LinkGeometry, Mimic, Robot

from tests.support.mesh_files import CUBE_TRIANGLES, CUBE_VERTICES
from tests.support.robots import REAL_ROBOTS, arm_archive, real_robot

FloatArray = npt.NDArray[np.float64]
ROUNDING = 1e-9  # of sampled points, metres


def rotation(axis: FloatArray, angle: float) -> FloatArray:
    """By the exponential series of the cross product matrix: nothing in common with the kernel's formula."""
    x, y, z = axis * angle
    generator = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / 1024
    R, term = np.eye(3), np.eye(3)
    for k in range(1, 8):
        term = term @ generator / k
        R = R + term
    for _ in range(10):
        R = R @ R
    return R


def rigid(rng: np.random.Generator, reach_m: float = 1.0) -> FloatArray:
    T = np.eye(4)
    axis = rng.normal(size=3)
    T[:3, :3] = rotation(axis / np.linalg.norm(axis), rng.uniform(-np.pi, np.pi))
    u, _, vt = np.linalg.svd(T[:3, :3])
    T[:3, :3] = u @ vt
    T[:3, 3] = rng.uniform(-reach_m, reach_m, 3)
    return T


def random_robot(rng: np.random.Generator, links: int) -> Robot:
    """A random tree; some joints mimic others, some links have no geometry."""
    bodies, joints, moving = [], [], []
    for i in range(links):
        cube = TriangleMesh((CUBE_VERTICES - rng.uniform(size=3)) * rng.uniform(0.01, 1, 3), CUBE_TRIANGLES)
        bodies.append(Link(f"l{i}", (LinkGeometry("mesh", cube),) if rng.random() < 0.8 else ()))
        if i == 0:
            continue
        axis = rng.normal(size=3)
        x, y, z = axis / np.linalg.norm(axis)
        motion = JointMotion(int(rng.integers(3)))
        mimic = None
        if moving and motion is not JointMotion.FIXED and rng.random() < 0.25:
            mimic = Mimic(str(rng.choice(moving)), rng.uniform(-2, 2), rng.uniform(-1, 1))
        elif motion is not JointMotion.FIXED:
            moving.append(f"j{i}")
        parent = f"l{rng.integers(max(0, i - 3), i)}"
        joints.append(Joint(f"j{i}", motion, parent, f"l{i}", rigid(rng), (x, y, z), -2.0, 2.0, mimic))
    return Robot("random", bodies, joints)


def plain_link_poses(robot: Robot, q: FloatArray, T_map_base: FloatArray) -> FloatArray:
    values = dict(zip(robot.joint_names, q, strict=True))
    for joint in [*robot.joints] * len(robot.joints):
        if joint.mimic and joint.mimic.joint in values:
            values[joint.name] = joint.mimic.multiplier * values[joint.mimic.joint] + joint.mimic.offset
    poses = {robot.links[0].name: T_map_base}
    by_child = {joint.child: joint for joint in robot.joints}
    for link in robot.links[1:]:
        joint = by_child[link.name]
        moved = np.eye(4)
        if joint.motion is JointMotion.REVOLUTE:
            moved[:3, :3] = rotation(np.array(joint.axis), values[joint.name])
        elif joint.motion is JointMotion.PRISMATIC:
            moved[:3, 3] = np.array(joint.axis) * values[joint.name]
        poses[link.name] = poses[joint.parent] @ joint.T_parent_joint @ moved
    return np.stack([poses[link.name] for link in robot.links])


@settings(deadline=None, max_examples=100)
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.integers(1, 150))
def test_link_poses_are_the_products_of_the_joints(seed: int, links: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, links)
    q = rng.uniform(-4, 4, (count, len(robot.joint_names)))
    T = np.stack([rigid(rng, 1e3) for _ in range(count)])
    poses = robot.link_poses(q, T)
    for i in range(min(count, 10)):
        np.testing.assert_allclose(poses[i], plain_link_poses(robot, q[i], T[i]), atol=1e-9)
    np.testing.assert_array_equal(robot.link_poses(q, T[0])[-1], robot.link_poses(q[-1], T[0])[0])


@pytest.mark.parametrize("name", REAL_ROBOTS)
def test_link_poses_equal_another_librarys(name: str) -> None:
    yourdfpy = pytest.importorskip("yourdfpy", reason="pip install yourdfpy")
    path: Path = real_robot(name)
    peer = yourdfpy.URDF.load(str(path), build_scene_graph=True, load_meshes=False, load_collision_meshes=False)
    robot = Robot.from_urdf(path)
    assert set(peer.actuated_joint_names) == set(robot.joint_names)
    order = [robot.joint_names.index(joint) for joint in peer.actuated_joint_names]
    for q in robot.sample_configurations(5, np.random.default_rng(0)):
        peer.update_cfg(q[order])
        poses = robot.link_poses(q)[0]
        for i, link in enumerate(robot.link_names):
            np.testing.assert_allclose(poses[i], peer.get_transform(link), atol=1e-9, err_msg=link)


def test_configurations_that_cannot_be_right_are_named() -> None:
    robot = Robot.from_archive(arm_archive())
    good = np.zeros((3, 5))
    bad = good.copy()
    bad[2, 1] = np.nan
    with pytest.raises(InvalidInputError, match=r"configurations\[2\]\[1\] is not finite"):
        robot.link_poses(bad)
    with pytest.raises(InvalidInputError, match=r"shape \(n, 5\), got \(3, 4\)"):
        robot.link_poses(good[:, :4])
    with pytest.raises(InvalidInputError, match="3 configurations do not go with 2"):
        robot.link_poses(good, np.stack([np.eye(4)] * 2))
    with pytest.raises(InvalidInputError, match="not rigid"):
        robot.link_poses(good, np.diag([2.0, 2.0, 2.0, 1.0]))
    with pytest.raises(InvalidInputError, match="joint values are needed"):
        robot.link_poses()
    with pytest.raises(InvalidInputError, match="no joint 'x'"):
        robot.configuration({"x": 1.0})
    assert robot.configuration({"turn": 1.0}).tolist() == [1.0, 0.0, 0.0, 0.5, 0.0]


def between(T_from: FloatArray, T_to: FloatArray, t: float) -> FloatArray:
    """Position linearly, rotation about one axis at constant speed."""
    R = T_from[:3, :3].T @ T_to[:3, :3]
    angle = np.arctan2(np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]), np.trace(R) - 1)
    sine = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    axis = sine / np.linalg.norm(sine) if np.linalg.norm(sine) > 1e-12 else np.array([1.0, 0, 0])
    T = T_from.copy()
    T[:3, :3] = T_from[:3, :3] @ rotation(axis, t * angle)
    T[:3, 3] = (1 - t) * T_from[:3, 3] + t * T_to[:3, 3]
    return T


def moved_points(
    robot: Robot, q: tuple[FloatArray, FloatArray], T: tuple[FloatArray, FloatArray], times: FloatArray
) -> list[FloatArray]:
    """Per link (times, points, 3): its vertices along the motion."""
    configurations = (1 - times)[:, None] * q[0] + times[:, None] * q[1]
    poses = robot.link_poses(configurations, np.stack([between(*T, t) for t in times]))
    return [
        link.mesh.vertices @ poses[:, i, :3, :3].transpose(0, 2, 1) + poses[:, i, None, :3, 3]
        for i, link in enumerate(robot.links)
    ]


def speeds_within(robot: Robot, rng: np.random.Generator, turn: float) -> list[float]:
    """Checks one random motion; returns, per link that moves, its greatest sampled speed as a share of the bound."""
    q = (robot.sample_configurations(1, rng)[0], robot.sample_configurations(1, rng)[0])
    q = (q[0], q[0] + turn * (q[1] - q[0]))
    T_from = rigid(rng)
    T_to = between(T_from, rigid(rng), turn)
    bounds = robot.motion_bounds(q[0], q[1], T_from, T_to)[0]
    times = np.linspace(0, 1, 25)
    shares = []
    for points, bound in zip(moved_points(robot, q, (T_from, T_to), times), bounds, strict=True):
        if points.shape[1] == 0:
            assert bound == 0
            continue
        moved = np.linalg.norm(np.diff(points, axis=0), axis=2).max() / times[1]
        assert moved <= bound + ROUNDING
        ends = np.linalg.norm(points[-1] - points[0], axis=1).max()
        assert ends <= bound + ROUNDING
        if bound > 1e-6:
            shares.append(float(moved / bound))
    return shares


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 10), st.sampled_from([0.0, 1e-6, 0.01, 0.2, 1.0]))
def test_no_point_moves_faster_than_its_links_bound(seed: int, links: int, turn: float) -> None:
    rng = np.random.default_rng(seed)
    speeds_within(random_robot(rng, links), rng, turn)


@pytest.mark.parametrize("name", REAL_ROBOTS)
def test_motion_bounds_of_real_robots_hold_and_are_tight(name: str) -> None:
    robot = Robot.from_urdf(real_robot(name))
    rng = np.random.default_rng(3)
    shares = [share for _ in range(4) for share in speeds_within(robot, rng, 0.05)]
    # A sum of each joint's worst case: different joints' speeds hardly ever add up fully.
    assert np.median(shares) > 0.4


def test_one_joint_alone_is_bounded_closely() -> None:
    robot = Robot.from_archive(arm_archive())
    rest = robot.configuration()
    for name, least in (("turn", 0.85), ("slide", 0.999), ("elbow", 0.9), ("finger_l", 0.999)):
        moved = rest.copy()
        moved[robot.joint_names.index(name)] += 0.01
        bounds = robot.motion_bounds(rest, moved)[0]
        points = moved_points(robot, (rest, moved), (np.eye(4), np.eye(4)), np.array([0.0, 1.0]))
        for link, at, bound in zip(robot.links, points, bounds, strict=True):
            if link.geometries and bound > 0:
                assert np.linalg.norm(at[1] - at[0], axis=1).max() >= least * bound, (name, link.name)
    assert (robot.motion_bounds(rest, rest) == 0).all()


def test_padding_widens_motion_bounds() -> None:
    robot = Robot.from_archive(arm_archive())
    q = robot.sample_configurations(2, np.random.default_rng(1))
    wider = robot.with_padding(0.1).motion_bounds(q[0], q[1]) - robot.motion_bounds(q[0], q[1])
    assert wider[0, robot.link_index("hand")] > 0
    assert wider.min() >= 0
