"""A box, axis-aligned or turned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .placement import Float64Array, Placement, rotation_from_rpy
from .shape import SMALLEST_DIVISOR


@dataclass(frozen=True, slots=True)
class Box:
    """A solid box; `half_size_m` (3,) float64 along the axes of its placement."""

    placement: Placement
    half_size_m: Float64Array

    @classmethod
    def between(cls, lo: tuple[float, float, float], hi: tuple[float, float, float]) -> Box:
        """Axis-aligned box with corners `lo` and `hi`, metres, map frame."""
        low, high = np.array(lo, dtype=np.float64), np.array(hi, dtype=np.float64)
        return cls(Placement((low + high) / 2.0), (high - low) / 2.0)

    @classmethod
    def turned(
        cls,
        center: tuple[float, float, float],
        size_m: tuple[float, float, float],
        yaw_rad: float,
        roll_rad: float = 0.0,
    ) -> Box:
        """Box of edge lengths `size_m` around `center`, rolled about its x axis, then turned about z."""
        rotation = rotation_from_rpy(roll_rad=roll_rad, yaw_rad=yaw_rad)
        return cls(Placement(np.array(center, dtype=np.float64), rotation), np.array(size_m, dtype=np.float64) / 2.0)

    @property
    def center(self) -> Float64Array:
        return self.placement.center

    @property
    def bounding_radius_m(self) -> float:
        return float(np.linalg.norm(self.half_size_m))

    def ray_interval(self, origins: Float64Array, directions: Float64Array) -> tuple[Float64Array, Float64Array]:
        origin = self.placement.points_to_shape(origins)
        direction = self.placement.directions_to_shape(directions)
        inverse = 1.0 / np.where(np.abs(direction) < SMALLEST_DIVISOR, SMALLEST_DIVISOR, direction)
        to_low = (-self.half_size_m - origin) * inverse
        to_high = (self.half_size_m - origin) * inverse
        # Column by column: numpy's reduction over an axis of length 3 is several times slower.
        near, far = np.minimum(to_low, to_high), np.maximum(to_low, to_high)
        enter = np.maximum(np.maximum(near[:, 0], near[:, 1]), near[:, 2])
        leave = np.minimum(np.minimum(far[:, 0], far[:, 1]), far[:, 2])
        return enter, leave

    def signed_distance(self, points: Float64Array) -> Float64Array:
        beyond = np.abs(self.placement.points_to_shape(points)) - self.half_size_m
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        inside = np.minimum(beyond.max(axis=1), 0.0)
        distance: Float64Array = outside + inside
        return distance
