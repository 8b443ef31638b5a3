"""What a map is held against: the true geometry, or a reference map where that is not known."""

from __future__ import annotations

from typing import Protocol

import numpy as np
import numpy.typing as npt

from rayvox import _native
from rayvox.map_queries import MapQueries
from rayvox.robot import Robot

FloatArray = npt.NDArray[np.float64]
ROBOT_FREE, ROBOT_COLLIDES, ROBOT_UNDECIDED = 0, 1, 2


class GroundTruth(Protocol):
    """Answers about the true geometry in the part of space that the scans saw.

    seen_surface: (n, 3) points on surfaces; seen_free: (m, 3) points of free space; metres, map frame, spread evenly.
    """

    seen_surface: FloatArray
    seen_free: FloatArray

    def distance_m(self, points: FloatArray) -> FloatArray:
        """Distance (n,) of points (n, 3) to the nearest true surface."""

    def holds_surface(self, centres: FloatArray, edge_m: float) -> npt.NDArray[np.bool_]:
        """Whether something solid comes into each of the cells with these centres (n, 3), or may: (n,)."""

    def robot_states(self, robot: Robot, configurations: FloatArray, T_map_base: FloatArray) -> npt.NDArray[np.uint8]:
        """(n,) ROBOT_FREE, ROBOT_COLLIDES, or ROBOT_UNDECIDED where the truth is not known."""


class NearestPoint:
    """Distances to the nearest of many points, by the kernel's tree over triangles that are points."""

    def __init__(self, points: FloatArray) -> None:
        every = np.arange(len(points), dtype=np.int32)
        self._tree = _native.TriangleTree(np.ascontiguousarray(points), np.stack([every] * 3, axis=1))

    def distance_m(self, points: FloatArray) -> FloatArray:
        """(n,) of points (n, 3), metres."""
        return self._tree.distances(np.ascontiguousarray(points))


def occupied_centres(octree: MapQueries) -> FloatArray:
    """Centres (n, 3) of all occupied finest-level cells, metres."""
    keys, depth, log_odds = octree.leaves()
    occupied = log_odds >= octree.sensor_model.native.occupied_log_odds
    lowest, wide = keys[occupied], 1 << (octree.depth - depth[occupied].astype(np.int64))
    cells = [lowest[wide == 1]]
    for size in np.unique(wide[wide > 1]):
        inside = np.stack(np.meshgrid(*[np.arange(size)] * 3, indexing="ij"), -1).reshape(-1, 3)
        cells.append((lowest[wide == size][:, None] + inside).reshape(-1, 3))
    centres: FloatArray = (np.concatenate(cells) + 0.5) * octree.resolution_m
    return centres


def thinned(points: FloatArray, edge_m: float, most: int, rng: np.random.Generator) -> FloatArray:
    """At most one point per cell of this edge, and at most so many: evenly spread, wherever rays were dense."""
    _, first = np.unique(np.floor(points / edge_m).astype(np.int64), axis=0, return_index=True)
    return points[rng.permutation(np.sort(first))[:most]]
