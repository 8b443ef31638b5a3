"""What every solid of a scene can answer."""

from __future__ import annotations

from typing import Protocol

from .placement import Float64Array

SMALLEST_DIVISOR = 1e-300
"""Stands in for a zero direction component, so that a slab test meets infinities but never 0/0."""


class Shape(Protocol):
    """A closed convex solid in the map frame."""

    @property
    def center(self) -> Float64Array:
        """Centre of the bounding sphere, (3,) float64 metres, map frame."""

    @property
    def bounding_radius_m(self) -> float:
        """Radius of a sphere around `center` that encloses the solid."""

    def ray_interval(self, origins: Float64Array, directions: Float64Array) -> tuple[Float64Array, Float64Array]:
        """Where rays run inside the solid.

        origins (3,) or (n,3) metres and unit directions (n,3), both float64 in the map frame; returns enter (n,) and
        exit (n,) in metres along the ray, enter > exit where the line misses the solid. Both may be negative.
        """

    def signed_distance(self, points: Float64Array) -> Float64Array:
        """Distance (n,) float64 metres from points (n,3) to the surface, negative inside."""
