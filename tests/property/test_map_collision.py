"""CollisionChecker against every triangle and every voxel."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import rayvox
from rayvox import _native

from tests.support.robots import arm_archive
from tests.support.triangle_cubes import gaps

FloatArray = npt.NDArray[np.float64]
SEEDS = range(6)


def random_map(rng: np.random.Generator, resolution_m: float) -> rayvox.MapSnapshot:
    occupancy_map = rayvox.OccupancyMap(resolution_m)
    for _ in range(3):
        occupancy_map.insert_scan(rng.normal(0, 0.8, (40, 3)), origin=tuple(rng.normal(0, 0.3, 3)))
    return occupancy_map.snapshot()


def random_poses(rng: np.random.Generator, count: int, reach_m: float) -> FloatArray:
    poses = np.tile(np.eye(4), (count, 1, 1))
    rotations = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    poses[:, :3, :3] = rotations * np.linalg.det(rotations)[:, None, None]
    poses[:, :3, 3] = rng.uniform(-reach_m, reach_m, (count, 3))
    return poses


def brute_force(map_snapshot: rayvox.MapSnapshot, robot: rayvox.Robot, T_map_links: FloatArray) -> FloatArray:
    """Over all occupied voxels, the smallest gap to any link; below 0 also where a voxel is inside of one."""
    keys, depth, log_odds = map_snapshot.leaves()
    occupied = log_odds >= 0
    halves = 0.5 * 2.0 ** (map_snapshot.depth - depth[occupied]) * map_snapshot.resolution_m
    centres = keys[occupied] * map_snapshot.resolution_m + halves[:, None]
    least = np.inf
    for link, T in zip(robot.links, T_map_links, strict=True):
        if not link.geometries:
            continue
        vertices = link.mesh.vertices @ T[:3, :3].T + T[:3, 3]
        least = min(least, gaps(vertices[link.mesh.triangles], centres, halves + link.padding_m).min())
        tree = _native.TriangleTree(link.mesh.vertices, link.mesh.triangles)
        if tree.inside((centres - T[:3, 3]) @ T[:3, :3]).any():
            least = -1.0
    return least


@pytest.fixture(scope="module")
def arm() -> rayvox.Robot:
    return rayvox.Robot.from_archive(arm_archive())


@pytest.mark.parametrize("seed", SEEDS)
def test_verdicts_are_those_of_all_triangles_against_all_voxels(arm: rayvox.Robot, seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_snapshot = random_map(rng, float(rng.choice([0.02, 0.1, 0.4])))
    robot = arm.with_padding(0.01) if seed % 2 else arm
    q, T = robot.sample_configurations(40, rng), random_poses(rng, 40, 2.5)
    verdicts = rayvox.CollisionChecker(map_snapshot, robot).check(q, T).verdicts
    T_map_links = robot.link_poses(q, T)
    distances = np.array([brute_force(map_snapshot, robot, poses) for poses in T_map_links])
    decided = np.abs(distances) > 1e-9
    assert (verdicts[decided] == (distances < 0)[decided]).all()
    assert decided.sum() > 35
    assert 0 < (verdicts == rayvox.CollisionVerdict.OCCUPIED).sum() < 40


@pytest.mark.parametrize("seed", SEEDS)
def test_unknown_space_changes_free_poses_only(arm: rayvox.Robot, seed: int) -> None:
    rng = np.random.default_rng(seed)
    occupancy_map = rayvox.OccupancyMap(0.1)
    directions = rng.normal(size=(20000, 3))
    directions *= 2.5 / np.linalg.norm(directions, axis=1)[:, None]
    occupancy_map.insert_scan(np.array([[1.5, 0.3, 0.2]]), no_return=directions)
    map_snapshot = occupancy_map.snapshot()
    q, T = arm.sample_configurations(60, rng), random_poses(rng, 60, 1.5)
    ignoring = rayvox.CollisionChecker(map_snapshot, arm, unknown="free").check(q, T).verdicts
    minding = rayvox.CollisionChecker(map_snapshot, arm, unknown="occupied").check(q, T, contacts="all")
    assert ((minding.verdicts == 1) == (ignoring == 1)).all()
    assert set(ignoring) <= {0, 1}
    assert {0, 2} <= set(minding.verdicts)
    assert minding.contacts is not None
    unknown = np.isnan(minding.contacts.log_odds)
    states = map_snapshot.states_at(minding.contacts.centre_m)
    assert (states[unknown] == 0).all()
    assert (states[~unknown] == 2).all()
    for i in np.flatnonzero(minding.verdicts == 0):
        for link, pose in zip(arm.links, arm.link_poses(q[i], T[i])[0], strict=True):
            corners = link.mesh.vertices @ pose[:3, :3].T + pose[:3, 3]
            assert (map_snapshot.states_at(corners) == 1).all()


def test_moving_the_map_and_the_robot_a_million_metres_changes_no_verdict() -> None:
    rng = np.random.default_rng(3)
    points = rng.normal(0, 3, (200, 3))
    robot = rayvox.Robot.from_archive(arm_archive())
    q, T = robot.sample_configurations(200, rng), random_poses(rng, 200, 6)
    verdicts = []
    for offset in ([0.0, 0.0, 0.0], [1e6, -1e6, 5e5]):
        occupancy_map = rayvox.OccupancyMap(1.0, depth=21)
        pose = np.eye(4)
        pose[:3, 3] = offset
        occupancy_map.insert_scan(points, pose)
        moved = T.copy()
        moved[:, :3, 3] += offset
        verdicts.append(rayvox.CollisionChecker(occupancy_map.snapshot(), robot).check(q, moved).verdicts)
    assert (verdicts[0] == verdicts[1]).all()
    assert 20 < verdicts[0].sum() < 180
