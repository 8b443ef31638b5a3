"""The robot's own body taken out of what its sensors see."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.arrays import as_points, as_points_f64, as_pose
from rayvox.robot.robot import Robot


class ScanPoint(IntEnum):
    """What BodyFilter.classify says of a point."""

    KEPT = 0
    ON_BODY = 1
    BEHIND_BODY = 2


class BodyFilter:
    """Tells points on a robot's padded body, and rays through it, from the rest of a scan. Thread-safe.

    A point is on the body within the padding of a link's surface, or inside a closed part of it. A ray goes through
    the body where it comes within the padding of a link's surface, except of links that hold the sensor itself.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._meshes = [
            _native.TriangleTree(link.mesh.vertices, link.mesh.triangles) if link.geometries else None
            for link in robot.links
        ]
        self._capsules = np.array([link.capsule for link in robot.links])

    def classify(
        self,
        points: npt.ArrayLike,
        configuration: npt.ArrayLike | None = None,
        T_base_sensor: npt.ArrayLike | None = None,
        origin: npt.ArrayLike = (0.0, 0.0, 0.0),
        padding_m: float | Mapping[str, float] = 0.0,
    ) -> npt.NDArray[np.uint8]:
        """(n,) ScanPoint of each point; the ends of rays without return are classified alike.

        points: (n, 3) float32 or float64, and `origin` of the beams, both in the sensor's frame, metres.
        configuration: (j,) joint values at the scan's time. T_base_sensor: (4, 4) pose of the sensor on the robot's
        base; None for identity; of one that is fastened to a link: link_poses(configuration)[0, link_index(name)].
        padding_m: on top of that of all links, or of the named ones. Raises InvalidInputError.
        """
        pose = as_pose(T_base_sensor, "T_base_sensor")
        T_sensor_base = np.eye(4) if pose is None else _inverse(pose)
        T_sensor_links = self._robot.link_poses(configuration, T_sensor_base)
        return _native.filter_body(
            self._meshes,
            self._capsules,
            self._robot.paddings_m(padding_m),
            T_sensor_links[0],
            as_points(points, "points"),
            as_points_f64(origin, "origin"),
        )


def _inverse(T: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    inverse = np.eye(4)
    inverse[:3, :3] = T[:3, :3].T
    inverse[:3, 3] = -T[:3, :3].T @ T[:3, 3]
    return inverse
