"""A robot of the service: the upload, the model read from it, and what is said about it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

from rayvox import BodyFilter, Robot

from rayvox_service.robot_config import RobotConfig
from rayvox_service.robot_variant import RobotVariant

# Whose meshes and hierarchies are kept; a planner asks of one or two at a time.
KEPT_VARIANTS = 8


@dataclass(frozen=True, slots=True)
class StoredRobot:
    """`variant` is the robot so changed, `body_filter` the filter of its body; both raise rayvox.InvalidInputError."""

    config: RobotConfig
    robot: Robot
    variant: Callable[[RobotVariant], Robot] = field(init=False, repr=False, compare=False)
    body_filter: Callable[[RobotVariant], BodyFilter] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        variant = lru_cache(KEPT_VARIANTS)(lambda asked: asked.of(self.robot))
        object.__setattr__(self, "variant", variant)
        object.__setattr__(self, "body_filter", lru_cache(KEPT_VARIANTS)(lambda asked: BodyFilter(variant(asked))))

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
