"""An indoor scene and simulated sensors; needs nothing but numpy.

Frames: the map frame is fixed to the building (z up, floor at z = 0, metres); a scan's points are in its sensor's frame
and `T_map_sensor` maps them into the map.
"""

from .benchmark_views import benchmark_sweeps, benchmark_views, look_at, wandering_views
from .box import Box
from .building import make_building
from .cylinder import Cylinder
from .depth_camera import DepthCamera, DepthCapture, Intrinsics
from .placement import Placement, rigid_transform, rotation_from_rpy
from .random_floor import make_random_floor, random_floor_run
from .robot_path import path_length_m, robot_boxes, robot_poses
from .robot_run import T_BASE_CAMERA, T_BASE_LIDAR, RobotRun
from .scan import Scan
from .scene import Scene
from .shape import Shape
from .sphere import Sphere
from .spinning_lidar import SpinningLidar

__all__ = [
    "T_BASE_CAMERA",
    "T_BASE_LIDAR",
    "Box",
    "Cylinder",
    "DepthCamera",
    "DepthCapture",
    "Intrinsics",
    "Placement",
    "RobotRun",
    "Scan",
    "Scene",
    "Shape",
    "Sphere",
    "SpinningLidar",
    "benchmark_sweeps",
    "benchmark_views",
    "look_at",
    "make_building",
    "make_random_floor",
    "path_length_m",
    "random_floor_run",
    "rigid_transform",
    "robot_boxes",
    "robot_poses",
    "rotation_from_rpy",
    "wandering_views",
]
