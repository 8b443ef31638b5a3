"""The drive through the building: office, corridor, laboratory, meeting room, hall."""

from __future__ import annotations

import numpy as np

from .placement import Float64Array, rigid_transform, rotation_from_rpy

ROBOT_SIZE_M = (0.6, 0.5, 0.7)
"""Length, width and height of the robot's body."""
ROBOT_GROUND_CLEARANCE_M = 0.1

_WAYPOINTS = np.array(
    [
        (-7.2, 3.2), (-5.5, 2.6), (-5.5, 0.1), (-7.0, 0.3), (-7.0, -0.2), (-7.0, -2.4), (-7.6, -3.8),
        (-5.2, -3.6), (-5.4, -2.4), (-7.0, -2.0), (-7.0, 0.0), (0.5, 0.0), (0.5, 1.8), (2.3, 1.9),
        (2.4, 4.7), (1.6, 5.4), (-2.3, 5.4), (-3.0, 4.7), (-2.9, 2.2), (-1.9, 1.7), (0.5, 1.8),
        (0.5, 0.0), (7.0, 0.0), (8.4, 0.4), (8.2, 1.8), (6.2, 2.0), (5.4, 0.4), (5.6, -1.3),
        (6.8, -2.6), (8.9, -1.4),
    ]
)  # fmt: skip


def robot_poses(count: int) -> Float64Array:
    """`count` poses T_map_base (count,4,4) float64, evenly spaced along the drive, x forward, z up, on the floor."""
    corners = _WAYPOINTS
    for _ in range(3):
        corners = _cut_corners(corners)
    steps = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    stations = np.linspace(0.0, travelled[-1], count)
    positions = _along(corners, travelled, stations)
    ahead = _along(corners, travelled, np.minimum(stations + 0.2, travelled[-1]))
    behind = _along(corners, travelled, np.maximum(stations - 0.2, 0.0))
    headings = np.arctan2(ahead[:, 1] - behind[:, 1], ahead[:, 0] - behind[:, 0])
    return np.stack(
        [
            rigid_transform(rotation_from_rpy(yaw_rad=float(heading)), np.array([x, y, 0.0]))
            for (x, y), heading in zip(positions, headings, strict=True)
        ]
    )


def path_length_m() -> float:
    """Length of the drive in metres."""
    positions = robot_poses(2000)[:, :2, 3]
    return float(np.linalg.norm(np.diff(positions, axis=0), axis=1).sum())


def robot_boxes(T_map_base: Float64Array) -> tuple[Float64Array, Float64Array]:
    """Axis-aligned boxes, lo and hi (n,3) float64 metres, that hold the robot's body at poses (n,4,4)."""
    length, width, height = ROBOT_SIZE_M
    forward, sideways = np.abs(T_map_base[:, :2, 0]), np.abs(T_map_base[:, :2, 1])
    reach = forward * (length / 2.0) + sideways * (width / 2.0)
    center = T_map_base[:, :2, 3]
    low, high = T_map_base[:, 2, 3] + ROBOT_GROUND_CLEARANCE_M, T_map_base[:, 2, 3] + ROBOT_GROUND_CLEARANCE_M + height
    return np.column_stack([center - reach, low]), np.column_stack([center + reach, high])


def _cut_corners(corners: Float64Array) -> Float64Array:
    """One round of Chaikin's corner cutting; the ends stay."""
    first, second = corners[:-1], corners[1:]
    cut = np.stack([0.75 * first + 0.25 * second, 0.25 * first + 0.75 * second], axis=1).reshape(-1, 2)
    return np.concatenate([corners[:1], cut, corners[-1:]])


def _along(corners: Float64Array, travelled: Float64Array, stations: Float64Array) -> Float64Array:
    return np.column_stack([np.interp(stations, travelled, corners[:, axis]) for axis in (0, 1)])
