"""A recorded run: a robot with a depth camera and a spinning lidar drives through the building."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from .building import make_building
from .depth_camera import DepthCamera, DepthCapture
from .placement import Float64Array, rigid_transform, rotation_from_rpy
from .robot_path import path_length_m, robot_poses
from .scan import Scan
from .scene import Scene
from .spinning_lidar import SpinningLidar

ROBOT_SPEED_M_PER_S = 0.5

_OPTICAL_AXES = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""R_body_optical: a camera looks along z with x to the right, a body drives along x with z up."""

INDOOR_LIDAR_RANGE_M = 10.0
"""What leaves through a window is followed no farther: empty sky would be most of the map."""

T_BASE_CAMERA = rigid_transform(
    rotation_from_rpy(pitch_rad=np.radians(10.0)) @ _OPTICAL_AXES, np.array([0.2, 0.0, 0.6])
)
T_BASE_LIDAR = rigid_transform(np.eye(3), np.array([0.0, 0.0, 1.1]))


@dataclass(frozen=True)
class RobotRun:
    """`stations` stops along the drive: a depth image at each, a lidar sweep at every `lidar_every`-th.

    The same arguments give the same scans, bit for bit, in whatever order they are asked for. Poses are the truth.
    T_map_base: (stations,4,4) float64, where it stops instead of along the drive through the building.
    """

    stations: int = 60
    lidar_every: int = 4
    seed: int = 1
    scene: Scene = field(default_factory=make_building)
    camera: DepthCamera = field(default_factory=DepthCamera)
    lidar: SpinningLidar = field(default_factory=lambda: SpinningLidar(max_range_m=INDOOR_LIDAR_RANGE_M))
    T_map_base: Float64Array | None = None

    def __len__(self) -> int:
        """Number of scans."""
        return self.stations + len(range(0, self.stations, self.lidar_every))

    def base_poses(self) -> Float64Array:
        """T_map_base (stations,4,4) float64 of the robot at every stop."""
        return robot_poses(self.stations) if self.T_map_base is None else self.T_map_base

    def scans(self) -> Iterator[Scan]:
        """All scans in the order of their time."""
        for station, T_map_base in enumerate(self.base_poses()):
            if station % self.lidar_every == 0:
                random = np.random.default_rng([self.seed, station, 1])
                yield self.lidar.sweep(self.scene, T_map_base @ T_BASE_LIDAR, random, self._stamp_s(station))
            yield self.depth_capture(station, T_map_base).scan

    def depth_capture(self, station: int, T_map_base: Float64Array) -> DepthCapture:
        """The depth image taken at a stop, with its points."""
        random = np.random.default_rng([self.seed, station, 0])
        return self.camera.capture(self.scene, T_map_base @ T_BASE_CAMERA, random, self._stamp_s(station))

    def _stamp_s(self, station: int) -> float:
        return station * path_length_m() / max(self.stations - 1, 1) / ROBOT_SPEED_M_PER_S
