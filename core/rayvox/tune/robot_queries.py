"""What a planner gets from a map: verdicts on a robot's poses, and how long they take."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from rayvox.collision_checker import CollisionChecker, CollisionVerdict, UnknownPolicy
from rayvox.map_snapshot import MapSnapshot
from rayvox.robot import Link, LinkGeometry, Robot, simplified
from rayvox.tune.ground_truth import ROBOT_COLLIDES, ROBOT_FREE, FloatArray, GroundTruth
from rayvox.tune.machine_speed import clock_s

POSES = 200
_REPEATS = 5


@dataclass(frozen=True, slots=True)
class RobotFigures:
    """Of one map, robot and policy for unknown space.

    query_s: seconds a pose, in batches of POSES. false_free: of the poses that collide in truth, those called free.
    false_collision: of those that are free in truth, those called occupied. lost_free: of those, all that a planner
    cannot use, the ones that meet unknown space included. Shares from 0 to 1; nan where there is no such pose.
    """

    query_s: float
    false_free: float
    false_collision: float
    lost_free: float


@dataclass(frozen=True, eq=False)
class RobotProbe:
    """Poses of a robot in the space that was seen, and what is true of them."""

    robot: Robot
    configurations: FloatArray
    T_map_base: FloatArray
    make_states: Callable[[], npt.NDArray[np.uint8]]

    @cached_property
    def states(self) -> npt.NDArray[np.uint8]:
        """(n,), see GroundTruth.robot_states; worked out when first asked for."""
        return self.make_states()

    def figures(self, octree: MapSnapshot, unknown: UnknownPolicy, robot: Robot | None = None) -> RobotFigures:
        """robot: another model of the same robot, by default the one whose collisions are the truth."""
        checker = CollisionChecker(octree, robot or self.robot, unknown)
        verdicts = checker.check(self.configurations, self.T_map_base).verdicts
        collides, free = self.states == ROBOT_COLLIDES, self.states == ROBOT_FREE
        return RobotFigures(
            query_s=_least_s(lambda: checker.check(self.configurations, self.T_map_base)) / len(self.T_map_base),
            false_free=_share(verdicts[collides] == CollisionVerdict.FREE),
            false_collision=_share(verdicts[free] == CollisionVerdict.OCCUPIED),
            lost_free=_share(verdicts[free] != CollisionVerdict.FREE),
        )


def robot_probe(robot: Robot, truth: GroundTruth, seed: int = 0, count: int = POSES) -> RobotProbe:
    """Poses whose robot has its middle at a point of free space that was seen, turned about z, joints at random."""
    rng = np.random.default_rng(seed)
    configurations = robot.sample_configurations(count, rng)
    middle = _middle(robot)
    T = np.tile(np.eye(4), (count, 1, 1))
    angle = rng.uniform(0, 2 * np.pi, count)
    T[:, 0, 0] = T[:, 1, 1] = np.cos(angle)
    T[:, 1, 0] = np.sin(angle)
    T[:, 0, 1] = -T[:, 1, 0]
    places = truth.seen_free[rng.integers(len(truth.seen_free), size=count)]
    T[:, :3, 3] = places - T[:, :3, :3] @ middle
    return RobotProbe(robot, configurations, T, lambda: truth.robot_states(robot, configurations, T))


def _middle(robot: Robot) -> FloatArray:
    """Of the box around all links, in the robot's resting configuration; base frame."""
    poses = robot.link_poses(robot.configuration())[0]
    solid = [(link, T) for link, T in zip(robot.links, poses, strict=True) if link.geometries]
    corners = np.concatenate([link.mesh.vertices @ T[:3, :3].T + T[:3, 3] for link, T in solid])
    return np.asarray((corners.min(axis=0) + corners.max(axis=0)) / 2)


def with_detail(robot: Robot, error_m: float) -> Robot:
    """Links of fewer triangles, each padded by the proven error of its simplification, which is at most error_m."""
    links = []
    for link in robot.links:
        level = simplified(link.mesh, error_m) if link.geometries else None
        links.append(
            link
            if level is None
            else Link(link.name, (LinkGeometry("mesh", level.mesh),), link.padding_m + level.error_m)
        )
    return Robot(robot.name, links, robot.joints, robot.allowed_collisions)


def point_query_s(octree: MapSnapshot, truth: GroundTruth) -> float:
    """Seconds for the state of one point, in a batch of those of free space."""
    return _least_s(lambda: octree.states_at(truth.seen_free)) / max(1, len(truth.seen_free))


def _least_s(work: Callable[[], object]) -> float:
    seconds = []
    for _ in range(_REPEATS):
        started = clock_s()
        work()
        seconds.append(clock_s() - started)
    return min(seconds)


def _share(chosen: npt.NDArray[np.bool_]) -> float:
    return float(chosen.mean()) if len(chosen) else float("nan")
