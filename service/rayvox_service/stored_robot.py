"""A robot of the service: the upload, the model read from it, and what is said about it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rayvox import Robot

from rayvox_service.robot_config import RobotConfig


@dataclass(frozen=True, slots=True)
class StoredRobot:
    config: RobotConfig
    robot: Robot

    def summary(self) -> dict[str, Any]:
        """What the list of robots shows."""
        return {
            **self.config.model_dump(),
            "state": "ready",
            "links": len(self.robot.links),
            "joints": list(self.robot.joint_names),
            "triangles": self.robot.triangle_count,
        }

    def info(self) -> dict[str, Any]:
        """The summary, with limits, links and allowed collisions."""
        robot = self.robot
        allowed = robot.allowed_collisions.matrix
        solid = [i for i, link in enumerate(robot.links) if link.geometries]
        return {
            **self.summary(),
            "lower": [_finite(value) for value in robot.limits[0]],
            "upper": [_finite(value) for value in robot.limits[1]],
            "links": [
                {
                    "name": link.name,
                    "triangles": sum(len(geometry.mesh) for geometry in link.geometries),
                    "closed": link.is_closed,
                }
                for link in robot.links
            ],
            "allowed_collisions": [
                [robot.link_names[i], robot.link_names[k]] for i in solid for k in solid if i < k and allowed[i, k]
            ],
        }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
