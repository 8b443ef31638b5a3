"""Scans inserted into a map under one choice of settings, with the time that took."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rayvox.occupancy_map import OccupancyMap
from rayvox.ray_sampling import kept_rays
from rayvox.tune.candidate import MapSettings
from rayvox.tune.machine_speed import clock_s
from rayvox.tune.scan_input import PosedScan


@dataclass(frozen=True)
class MapRun:
    """occupancy_map: after the last scan. scan_s: (n,) seconds per scan. scan_bytes: (n,) of its rays, as float32."""

    occupancy_map: OccupancyMap
    scan_s: npt.NDArray[np.float64]
    scan_bytes: npt.NDArray[np.int64]


def build_map(scans: Sequence[PosedScan], settings: MapSettings, into: OccupancyMap | None = None) -> MapRun:
    """Inserts all scans, into an empty map unless one is given, and times each from points to updated octree."""
    occupancy_map = OccupancyMap(settings.resolution_m, settings.depth) if into is None else into
    seconds, sizes = [], []
    for scan in scans:
        started = clock_s()
        rays = insert_scan(occupancy_map, scan, settings)
        seconds.append(clock_s() - started)
        sizes.append(12 * rays)
    return MapRun(occupancy_map, np.array(seconds), np.array(sizes, dtype=np.int64))


def insert_scan(occupancy_map: OccupancyMap, scan: PosedScan, settings: MapSettings) -> int:
    """Inserts one scan as these settings have it; returns how many rays that were."""
    points, no_return = scan.points, scan.no_return
    if settings.ray_share < 1:
        points = points[kept_rays(len(points), settings.ray_share)]
        no_return = None if no_return is None else no_return[kept_rays(len(no_return), settings.ray_share)]
    ranges = [r for r in (scan.max_range_m, settings.max_range_m) if r is not None]
    result = occupancy_map.insert_scan(
        points,
        scan.T_map_sensor,
        max_range_m=min(ranges, default=None),
        no_return=no_return,
        engine=settings.engine,
        discretize=settings.discretize,
    )
    return result.statistics.ray_count
