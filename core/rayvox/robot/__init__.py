"""Robots: models from meshes and URDF, forward kinematics, motion bounds, levels of detail, self-filter."""

from rayvox.robot.allowed_collisions import AllowedCollisions
from rayvox.robot.body_filter import BodyFilter, ScanPoint
from rayvox.robot.joint import Joint, JointMotion, Mimic
from rayvox.robot.level_of_detail import LevelOfDetail, simplified
from rayvox.robot.link import Link, LinkGeometry
from rayvox.robot.robot import Robot

__all__ = [
    "AllowedCollisions",
    "BodyFilter",
    "Joint",
    "JointMotion",
    "LevelOfDetail",
    "Link",
    "LinkGeometry",
    "Mimic",
    "Robot",
    "ScanPoint",
    "simplified",
]
