"""check_motion against motions sampled finely."""

from __future__ import annotations

import numpy as np
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
