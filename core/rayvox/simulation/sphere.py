"""A sphere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .placement import Float64Array


@dataclass(frozen=True, slots=True)
class Sphere:
    """A solid sphere around `center` (3,) float64 metres, map frame."""

    center: Float64Array
    radius_m: float

    @classmethod
    def at(cls, x: float, y: float, z: float, radius_m: float) -> Sphere:
        """Sphere around (x, y, z), metres, map frame."""
        return cls(np.array([x, y, z], dtype=np.float64), radius_m)

    @property
    def bounding_radius_m(self) -> float:
        return self.radius_m

    def ray_interval(self, origins: Float64Array, directions: Float64Array) -> tuple[Float64Array, Float64Array]:
        to_center = self.center - origins
        closest = directions @ to_center if to_center.ndim == 1 else np.einsum("ij,ij->i", directions, to_center)
        miss_squared = np.sum(to_center * to_center, axis=-1) - closest * closest
        half_chord_squared = self.radius_m**2 - miss_squared
        half_chord = np.sqrt(np.maximum(half_chord_squared, 0.0))
        missed = half_chord_squared < 0.0
        enter = np.where(missed, np.inf, closest - half_chord)
        leave = np.where(missed, -np.inf, closest + half_chord)
        return enter, leave

    def signed_distance(self, points: Float64Array) -> Float64Array:
        distance: Float64Array = np.linalg.norm(points - self.center, axis=1) - self.radius_m
        return distance
