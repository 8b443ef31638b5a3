"""Six fixed depth views and three fixed lidar sweeps of the building, for benchmarks and equality tests."""

from __future__ import annotations

import numpy as np

from .building import make_building
from .depth_camera import DepthCamera, DepthCapture
from .placement import Float64Array, rigid_transform
from .scan import Scan
from .spinning_lidar import SpinningLidar

_VIEWS: dict[str, tuple[tuple[float, float, float], tuple[float, float, float]]] = {
    "office": ((-4.6, 1.6, 1.3), (-9.0, 4.6, 0.7)),
    "corridor": ((-9.5, 0.1, 1.2), (4.0, 0.0, 1.0)),
    "meeting_room": ((3.4, 1.5, 1.6), (-2.0, 4.2, 0.6)),
    "laboratory": ((-9.3, -1.4, 1.5), (-4.5, -5.0, 0.6)),
    "store": ((3.6, -1.4, 1.4), (-1.0, -5.4, 0.8)),
    "hall": ((4.6, 5.0, 1.7), (8.5, -4.5, 0.7)),
}
"""Name: where the camera stands and the point it looks at, metres, map frame."""

_SWEEPS = {"corridor": (-2.0, 0.0, 1.1), "meeting_room": (2.3, 2.4, 1.1), "hall": (6.6, 0.3, 1.1)}


def look_at(eye: tuple[float, float, float], target: tuple[float, float, float]) -> Float64Array:
    """T_map_camera (4,4) float64 of a level camera at `eye` whose z axis points at `target` (x right, y down)."""
    position = np.array(eye, dtype=np.float64)
    forward = np.array(target, dtype=np.float64) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, np.array([0.0, 0.0, 1.0]))
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    return rigid_transform(np.column_stack([right, down, forward]), position)


def benchmark_views(camera: DepthCamera | None = None) -> dict[str, DepthCapture]:
    """The six depth views by name; 76,800 rays each with the default camera, the same in every call."""
    lens, scene = camera or DepthCamera(), make_building()
    return {
        name: lens.capture(scene, look_at(eye, target), np.random.default_rng([2021, index]))
        for index, (name, (eye, target)) in enumerate(_VIEWS.items())
    }


def wandering_views(count: int, camera: DepthCamera | None = None) -> list[DepthCapture]:
    """`count` depth views from about where benchmark_views stand: 0.15 m around the place, 0.5 m around the point."""
    lens, scene, views = camera or DepthCamera(), make_building(), list(_VIEWS.values())
    captures = []
    for index in range(count):
        rng = np.random.default_rng([2023, index])
        eye, target = (np.array(point) for point in views[index % len(views)])
        x, y, z = (eye + rng.uniform(-0.15, 0.15, 3)).tolist()
        toward_x, toward_y, toward_z = (target + rng.uniform(-0.5, 0.5, 3)).tolist()
        captures.append(lens.capture(scene, look_at((x, y, z), (toward_x, toward_y, toward_z)), rng))
    return captures


def benchmark_sweeps(lidar: SpinningLidar | None = None) -> dict[str, Scan]:
    """The three lidar sweeps by name; 65,536 rays each with the default lidar, the same in every call."""
    device, scene = lidar or SpinningLidar(), make_building()
    return {
        name: device.sweep(scene, rigid_transform(np.eye(3), np.array(place)), np.random.default_rng([2022, index]))
        for index, (name, place) in enumerate(_SWEEPS.items())
    }
