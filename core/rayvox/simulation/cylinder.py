"""A cylinder along the z axis of its placement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .placement import Float64Array, Placement
from .shape import SMALLEST_DIVISOR


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A solid, capped cylinder of `radius_m` and `half_height_m`."""

    placement: Placement
    radius_m: float
    half_height_m: float

    @classmethod
    def upright(cls, x: float, y: float, z_low: float, z_high: float, radius_m: float) -> Cylinder:
        """Vertical cylinder over (x, y) from `z_low` to `z_high`, metres, map frame."""
        center = np.array([x, y, (z_low + z_high) / 2.0])
        return cls(Placement(center), radius_m, (z_high - z_low) / 2.0)

    @property
    def center(self) -> Float64Array:
        return self.placement.center

    @property
    def bounding_radius_m(self) -> float:
        return float(np.hypot(self.radius_m, self.half_height_m))

    def ray_interval(self, origins: Float64Array, directions: Float64Array) -> tuple[Float64Array, Float64Array]:
        origin = self.placement.points_to_shape(origins)
        direction = self.placement.directions_to_shape(directions)
        side_enter, side_leave = self._side_interval(origin, direction)
        along = direction[:, 2]
        inverse = 1.0 / np.where(np.abs(along) < SMALLEST_DIVISOR, SMALLEST_DIVISOR, along)
        to_low = (-self.half_height_m - origin[..., 2]) * inverse
        to_high = (self.half_height_m - origin[..., 2]) * inverse
        enter = np.maximum(side_enter, np.minimum(to_low, to_high))
        leave = np.minimum(side_leave, np.maximum(to_low, to_high))
        return enter, leave

    def _side_interval(self, origin: Float64Array, direction: Float64Array) -> tuple[Float64Array, Float64Array]:
        x, y = origin[..., 0], origin[..., 1]
        dx, dy = direction[:, 0], direction[:, 1]
        a = dx * dx + dy * dy
        half_b = x * dx + y * dy
        c = x * x + y * y - self.radius_m**2
        parallel = a < 1e-18
        discriminant = half_b * half_b - a * c
        root = np.sqrt(np.maximum(discriminant, 0.0))
        divisor = np.where(parallel, 1.0, a)
        enter, leave = (-half_b - root) / divisor, (-half_b + root) / divisor
        # A ray along the axis is inside the mantle everywhere or nowhere.
        inside_everywhere = np.where(c <= 0.0, -np.inf, np.inf)
        missed = discriminant < 0.0
        enter = np.where(parallel, inside_everywhere, np.where(missed, np.inf, enter))
        leave = np.where(parallel, -inside_everywhere, np.where(missed, -np.inf, leave))
        return enter, leave

    def signed_distance(self, points: Float64Array) -> Float64Array:
        local = self.placement.points_to_shape(points)
        beyond_side = np.hypot(local[:, 0], local[:, 1]) - self.radius_m
        beyond_cap = np.abs(local[:, 2]) - self.half_height_m
        outside = np.hypot(np.maximum(beyond_side, 0.0), np.maximum(beyond_cap, 0.0))
        distance: Float64Array = outside + np.minimum(np.maximum(beyond_side, beyond_cap), 0.0)
        return distance
