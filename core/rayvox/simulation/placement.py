"""Where a shape stands in the map: the centre of its own frame and that frame's axes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Float64Array = NDArray[np.float64]


def _map_axes() -> Float64Array:
    return np.eye(3)


@dataclass(frozen=True, slots=True)
class Placement:
    """A shape's frame: `center` (3,) float64 metres in the map frame, `rotation` (3,3) = R_map_shape."""

    center: Float64Array
    rotation: Float64Array = field(default_factory=_map_axes)

    def points_to_shape(self, points: Float64Array) -> Float64Array:
        """Map points (..., 3) in metres, seen from the shape's frame."""
        local: Float64Array = (points - self.center) @ self.rotation
        return local

    def directions_to_shape(self, directions: Float64Array) -> Float64Array:
        """Map directions (..., 3), turned into the shape's frame."""
        local: Float64Array = directions @ self.rotation
        return local


def rotation_from_rpy(roll_rad: float = 0.0, pitch_rad: float = 0.0, yaw_rad: float = 0.0) -> Float64Array:
    """Rotation matrix (3,3) float64 of roll about x, then pitch about y, then yaw about z (fixed axes)."""
    cr, sr = np.cos(roll_rad), np.sin(roll_rad)
    cp, sp = np.cos(pitch_rad), np.sin(pitch_rad)
    cy, sy = np.cos(yaw_rad), np.sin(yaw_rad)
    rotate_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    rotate_y = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    rotate_z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    rotation: Float64Array = rotate_z @ rotate_y @ rotate_x
    return rotation


def rigid_transform(rotation: Float64Array, translation: Float64Array) -> Float64Array:
    """Homogeneous transform (4,4) float64 from a rotation (3,3) and a translation (3,) in metres."""
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:3, 3] = translation
    return transform
