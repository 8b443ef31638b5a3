"""A scene of solids: what a perfect sensor would measure, and the truth to hold a map against."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .placement import Float64Array
from .shape import Shape


class Scene:
    """Union of solids in the map frame, metres."""

    def __init__(self, shapes: Sequence[Shape]) -> None:
        self.shapes: tuple[Shape, ...] = tuple(shapes)

    def cast_rays(self, origins: ArrayLike, directions: ArrayLike) -> Float64Array:
        """Exact distance along each ray to the first surface.

        origins (3,) shared by all rays, or (n,3), metres; directions (n,3) unit vectors; both in the map frame.
        Returns (n,) float64 metres, infinity where a ray meets nothing, 0 where it starts inside a solid.
        """
        origin = np.asarray(origins, dtype=np.float64)
        direction = np.ascontiguousarray(directions, dtype=np.float64)
        nearest = np.full(direction.shape[0], np.inf)
        for lower_bound, shape in self._nearest_first(origin):
            candidates = np.flatnonzero(_passes_near(shape, origin, direction) & (nearest > lower_bound))
            if candidates.size == 0:
                continue
            starts = origin if origin.ndim == 1 else origin[candidates]
            enter, leave = shape.ray_interval(starts, direction[candidates])
            met = (enter <= leave) & (leave >= 0.0)
            distance = np.where(met, np.maximum(enter, 0.0), np.inf)
            nearest[candidates] = np.minimum(nearest[candidates], distance)
        return nearest

    def _nearest_first(self, origin: Float64Array) -> list[tuple[float, Shape]]:
        """Shapes with a lower bound of the distance at which a ray can meet them, nearest first.

        Rays that have already met something nearer than the bound need no test; with one shared origin that is most.
        """
        if origin.ndim != 1:
            return [(-np.inf, shape) for shape in self.shapes]
        bounds = [float(shape.signed_distance(origin[None, :])[0]) for shape in self.shapes]
        return sorted(zip(bounds, self.shapes, strict=True), key=lambda pair: pair[0])

    def signed_distance(self, points: ArrayLike) -> Float64Array:
        """Distance from points (n,3) metres, map frame, to the nearest surface, (n,) float64, negative inside a solid.

        Exact outside; inside, where solids overlap, its size is a lower bound of the depth.
        """
        query = np.asarray(points, dtype=np.float64)
        distance = np.full(query.shape[0], np.inf)
        for shape in self.shapes:
            np.minimum(distance, shape.signed_distance(query), out=distance)
        return distance

    def is_occupied(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points (n,3) metres, map frame, lie in or on a solid, (n,) bool."""
        occupied: NDArray[np.bool_] = self.signed_distance(points) <= 0.0
        return occupied


def _passes_near(shape: Shape, origin: Float64Array, direction: Float64Array) -> NDArray[np.bool_]:
    """Which rays pass the shape's bounding sphere; the exact test is only run for those."""
    to_center = shape.center - origin
    distance_squared = np.sum(to_center * to_center, axis=-1)
    radius = shape.bounding_radius_m * (1.0 + 1e-9)
    near: NDArray[np.bool_]
    if to_center.ndim == 1:
        if distance_squared <= radius * radius:
            return np.ones(direction.shape[0], dtype=np.bool_)
        # Outside the sphere the rays that meet it form a cone around its centre.
        near = direction @ to_center >= np.sqrt(distance_squared - radius * radius) * (1.0 - 1e-9)
    else:
        along = np.einsum("ij,ij->i", direction, to_center)
        near = (distance_squared - along * along <= radius * radius) & (along >= -radius)
    return near
