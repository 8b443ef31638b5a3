"""How far a robot is from occupied voxels, from every triangle and every voxel that are not trivially farther."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from rayvox import MapSnapshot, Robot

from tests.support.triangle_cubes import distance_bounds

FloatArray = npt.NDArray[np.float64]
_CUBES_AT_ONCE = 256
# Alternating projections: most pairs are known to be farther after few.
_SWEEPS = (2, 8, 40, 200, 3000)


def occupied_cubes(map_snapshot: MapSnapshot) -> tuple[FloatArray, FloatArray]:
    """(n, 3) centres and (n,) half edges of the occupied leaves, metres."""
    keys, depth, log_odds = map_snapshot.leaves()
    occupied = log_odds >= map_snapshot.sensor_model.native.occupied_log_odds
    halves = 0.5 * 2.0 ** (map_snapshot.depth - depth[occupied].astype(np.int64)) * map_snapshot.resolution_m
    return keys[occupied] * map_snapshot.resolution_m + halves[:, None], halves


def least_distance_bounds(
    robot: Robot, T_map_links: FloatArray, centres: FloatArray, halves: FloatArray, within_m: float
) -> tuple[float, float]:
    """Bounds below and above of the least distance of links at (links, 4, 4) from cubes, if it is below within_m."""
    below = above = np.inf
    for triangles, cube, half in _near_pairs(robot, T_map_links, centres, halves, within_m):
        for sweeps in _SWEEPS:
            lower, upper = distance_bounds(triangles, cube, half, sweeps)
            below_of_decided = lower[upper - lower <= 1e-10]
            above = min(above, upper.min())
            below = min(below, below_of_decided.min(initial=np.inf))
            vague = (lower < min(above, within_m)) & (upper - lower > 1e-10)
            triangles, cube, half, lower = triangles[vague], cube[vague], half[vague], lower[vague]
            if not vague.any():
                break
        else:
            below = min(below, lower.min())
    return float(below), float(above)


def _near_pairs(
    robot: Robot, T_map_links: FloatArray, centres: FloatArray, halves: FloatArray, within_m: float
) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
    """Triangles, centres and half edges of the pairs whose boxes along the axes are less than that apart."""
    for link, T in zip(robot.links, T_map_links, strict=True):
        if not link.geometries:
            continue
        triangles = (link.mesh.vertices @ T[:3, :3].T + T[:3, 3])[link.mesh.triangles]
        low, high, grown = triangles.min(axis=1), triangles.max(axis=1), halves + link.padding_m
        gap = np.maximum(low.min(axis=0) - centres, centres - high.max(axis=0)) - grown[:, None]
        cubes = np.flatnonzero(np.linalg.norm(np.maximum(gap, 0), axis=1) < within_m)
        for start in range(0, len(cubes), _CUBES_AT_ONCE):
            some = cubes[start : start + _CUBES_AT_ONCE]
            apart = np.maximum(low[:, None] - centres[some], centres[some] - high[:, None]) - grown[some][:, None]
            t, c = np.nonzero((np.maximum(apart, 0) ** 2).sum(axis=2) < within_m**2)
            if len(t):
                yield triangles[t], centres[some[c]], grown[some[c]]
