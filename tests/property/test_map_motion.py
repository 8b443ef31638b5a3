"""check_motion against motions sampled finely."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import rayvox

from tests.support.robots import arm_archive


@pytest.mark.parametrize("seed", range(4))
def test_no_sampled_collision_is_missed_and_none_invented(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = rayvox.Robot.from_archive(arm_archive())
    occupancy_map = rayvox.OccupancyMap(0.05)
    # Around the robot, clear of its base, which does not move.
    angle, radius_m, height_m = rng.uniform(0, 2 * np.pi, 15), rng.uniform(0.45, 0.8, 15), rng.uniform(0.2, 0.9, 15)
    points = np.column_stack([radius_m * np.cos(angle), radius_m * np.sin(angle), height_m])
    occupancy_map.insert_scan(points, origin=(0.0, 0.0, 3.0))
    snapshot = occupancy_map.snapshot()
    checker = rayvox.CollisionChecker(snapshot, robot)
    q_from, q_to = robot.sample_configurations(30, rng), robot.sample_configurations(30, rng)
    result = checker.check_motion(q_from, q_to, tolerance_m=0.01)
    wider = rayvox.CollisionChecker(snapshot, robot, padding_m=0.02)
    for i in range(30):
        t = np.linspace(0, 1, 400)
        q = q_from[i] * (1 - t[:, None]) + q_to[i] * t[:, None]
        colliding = checker.check(q).verdicts != 0
        assert not colliding[t < result.free_until[i]].any()
        if result.verdicts[i] == 0:
            assert result.free_until[i] == 1.0
        else:
            assert (wider.check(q).verdicts != 0).any()
    assert 0 < (result.verdicts == 1).sum() < 30


def test_a_thin_obstacle_between_two_samples_is_found() -> None:
    robot = rayvox.Robot.from_archive(arm_archive())
    q_from, q_to = robot.configuration({"elbow": 1.5}), robot.configuration({"elbow": 1.5, "turn": 2 * np.pi})
    occupancy_map = rayvox.OccupancyMap(0.01)
    hand = robot.link_poses(robot.configuration({"elbow": 1.5, "turn": 2.0}))[0, robot.link_index("hand"), :3, 3]
    occupancy_map.insert_scan([hand], origin=tuple(hand + np.array([0, 0, 2])))
    checker = rayvox.CollisionChecker(occupancy_map.snapshot(), robot)
    result = checker.check_motion(q_from, q_to, tolerance_m=0.002)
    assert result.verdicts.tolist() == [1]
    assert 0.9 * 2.0 < result.free_until[0] * 2 * np.pi < 2.0
    with pytest.raises(rayvox.InvalidInputError):
        checker.check_motion(q_from, q_to, tolerance_m=0)


def about(axis: tuple[float, float, float], angle_rad: float) -> npt.NDArray[np.float64]:
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle_rad) * K + (1 - np.cos(angle_rad)) * K @ K)


@pytest.mark.parametrize("seed", range(3))
def test_no_collision_of_a_moving_base_slips_between_samples(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = rayvox.Robot.from_archive(arm_archive())
    occupancy_map = rayvox.OccupancyMap(0.05)
    occupancy_map.insert_scan(rng.uniform(-1.5, 1.5, (12, 3)), origin=(0.0, 0.0, 9.0))
    checker = rayvox.CollisionChecker(occupancy_map.snapshot(), robot)
    wider = rayvox.CollisionChecker(occupancy_map.snapshot(), robot, padding_m=0.02)
    q_from, q_to = robot.sample_configurations(25, rng), robot.sample_configurations(25, rng)
    T_from, T_to = np.tile(np.eye(4), (25, 1, 1)), np.tile(np.eye(4), (25, 1, 1))
    axes, angles = rng.normal(size=(25, 3)), rng.uniform(0, 3.1, 25)
    for i in range(25):
        T_from[i, :3, :3] = about((0.3, -0.2, 1.0), rng.uniform(0, 6))
        T_to[i, :3, :3] = T_from[i, :3, :3] @ about(tuple(axes[i]), angles[i])
    T_from[:, :3, 3], T_to[:, :3, 3] = rng.uniform(-1, 1, (25, 3)), rng.uniform(-1, 1, (25, 3))
    result = checker.check_motion(q_from, q_to, T_from, T_to, tolerance_m=0.01)
    for i in range(25):
        t = np.linspace(0, 1, 300)
        T = np.tile(np.eye(4), (300, 1, 1))
        T[:, :3, :3] = [T_from[i, :3, :3] @ about(tuple(axes[i]), angle) for angle in angles[i] * t]
        T[:, :3, 3] = np.outer(1 - t, T_from[i, :3, 3]) + np.outer(t, T_to[i, :3, 3])
        q = q_from[i] * (1 - t[:, None]) + q_to[i] * t[:, None]
        assert not (checker.check(q, T).verdicts != 0)[t < result.free_until[i] - 1e-9].any()
        assert result.verdicts[i] == 0 or (wider.check(q, T).verdicts != 0).any()
    assert 0 < (result.verdicts == 1).sum() < 25


def test_a_path_is_its_motions_one_after_the_other() -> None:
    rng = np.random.default_rng(5)
    robot = rayvox.Robot.from_archive(arm_archive())
    occupancy_map = rayvox.OccupancyMap(0.05)
    occupancy_map.insert_scan(np.array([[2.0, 0.0, 0.3]]), origin=(2.0, 0.0, 5.0))
    checker = rayvox.CollisionChecker(occupancy_map.snapshot(), robot)
    T = np.tile(np.eye(4), (5, 1, 1))
    T[:, 0, 3] = [-1.0, -0.5, 0.0, 4.0, 6.0]
    q = robot.sample_configurations(1, rng)[0]
    path, motions = checker.check_path(q, T), checker.check_motion(q, q, T[:-1], T[1:])
    assert motions.verdicts.tolist() == [0, 0, 1, 0]
    assert (path.verdict, path.free_until) == (1, 2 + motions.free_until[2])
    assert path.tolerance_m == 0.005
    free = checker.check_path(q, T[:3])
    assert (free.verdict, free.free_until) == (0, 2.0)
    with pytest.raises(rayvox.InvalidInputError, match="two waypoints"):
        checker.check_path(q, T[0])
    with pytest.raises(rayvox.InvalidInputError, match="make no motions"):
        checker.check_motion(q, q, T[:2], T[:3])
