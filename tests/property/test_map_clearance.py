"""CollisionChecker.clearance against every triangle and every voxel, by another method."""

from __future__ import annotations

import numpy as np
import pytest
import rayvox
from rayvox.robot import Robot

from tests.property.test_map_collision import random_map, random_poses
from tests.support.clearance_oracle import least_distance_bounds, occupied_cubes
from tests.support.datasets import data_path
from tests.support.robots import REAL_ROBOTS, arm_archive, real_robot


def require_exact(clearance: rayvox.Clearance, pose: int, bounds: tuple[float, float]) -> None:
    assert clearance.clearance_m[pose] <= bounds[1] + 1e-15
    assert clearance.clearance_m[pose] >= bounds[0] - 1e-9
    assert bounds[1] - bounds[0] < 1e-4


@pytest.mark.parametrize("seed", range(4))
def test_clearance_is_that_of_all_triangles_and_all_voxels(seed: int) -> None:
    rng = np.random.default_rng(seed)
    map_snapshot = random_map(rng, float(rng.choice([0.05, 0.1, 0.4])))
    robot = rayvox.Robot.from_archive(arm_archive())
    robot = robot.with_padding(0.01) if seed % 2 else robot
    q, T = robot.sample_configurations(40, rng), random_poses(rng, 40, 2.5)
    clearance = rayvox.CollisionChecker(map_snapshot, robot).clearance(q, T)
    cubes = occupied_cubes(map_snapshot)
    free = np.flatnonzero(clearance.verdicts == 0)[:8]
    assert len(free) > 3
    for pose, T_map_links in zip(free, robot.link_poses(q, T)[free], strict=True):
        within_m = clearance.clearance_m[pose] + 1e-6
        require_exact(clearance, pose, least_distance_bounds(robot, T_map_links, *cubes, within_m))


@pytest.mark.parametrize("name", REAL_ROBOTS)
def test_clearance_of_real_robots_in_a_real_map_is_never_too_much(name: str) -> None:
    map_snapshot = rayvox.OccupancyMap.load(str(data_path("octomap_maps/fr_079.bt"))).snapshot()
    robot = Robot.from_urdf(real_robot(name), root=real_robot(name).parent)
    rng = np.random.default_rng(0)
    centres, halves = occupied_cubes(map_snapshot)
    T = random_poses(rng, 60, 0)
    T[:, :3, 3] = centres[rng.integers(len(centres), size=60)] + rng.normal(0, 0.8, (60, 3))
    q = robot.configuration()
    clearance = rayvox.CollisionChecker(map_snapshot, robot).clearance(q, T)
    near = np.flatnonzero((clearance.verdicts == 0) & (clearance.clearance_m < 0.15))[:3]
    assert len(near) > 0
    for pose, T_map_links in zip(near, robot.link_poses(q, T)[near], strict=True):
        bounds = least_distance_bounds(robot, T_map_links, centres, halves, clearance.clearance_m[pose] + 1e-6)
        require_exact(clearance, pose, bounds)


def test_moving_the_map_and_the_robot_a_million_metres_changes_no_clearance() -> None:
    rng = np.random.default_rng(3)
    points = rng.normal(0, 3, (60, 3))
    robot = rayvox.Robot.from_archive(arm_archive())
    # The positions are whole: they stay what they are a million metres away.
    q, T = robot.sample_configurations(100, rng), random_poses(rng, 100, 6)
    T[:, :3, 3] = np.round(T[:, :3, 3])
    found = []
    for offset in ([0.0, 0.0, 0.0], [1e6, -1e6, 5e5]):
        occupancy_map = rayvox.OccupancyMap(1.0, depth=21)
        pose = np.eye(4)
        pose[:3, 3] = offset
        occupancy_map.insert_scan(points, pose)
        moved = T.copy()
        moved[:, :3, 3] += offset
        # As far as rounding of links' positions at a million metres allows.
        found.append(rayvox.CollisionChecker(occupancy_map.snapshot(), robot).clearance(q, moved).clearance_m)
    assert found[0] == pytest.approx(found[1], abs=1e-9)
    assert (found[0] > 0).sum() > 20
