"""The scan sequences on which rayvox's map must equal OctoMap's: every real one, thinned where OctoMap is slow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.support import datasets
from tests.support.datasets import PosedScan
from tests.support.scenes import room_scan

Float32Points = NDArray[np.float32]


@dataclass(frozen=True)
class MapScan:
    """Rays in the map frame, all float32: what both mappers are fed, with identity poses."""

    points: Float32Points
    origin: Float32Points
    no_return: Float32Points

    @property
    def all_ends(self) -> Float32Points:
        """Hits and ends without return: OctoMap knows no silent rays, it is fed these with a range that cuts them."""
        return np.concatenate([self.points, self.no_return])


@dataclass(frozen=True)
class EqualityInput:
    """A sequence, the resolution to map it at, and the range at which both mappers cut."""

    name: str
    resolution_m: float
    load: Callable[[], list[MapScan]]
    max_range_m: float | None = None


def _in_map(scans: list[PosedScan], every: int = 1) -> list[MapScan]:
    moved = [scan.in_map() for scan in scans]
    return [MapScan(points[::every], origin, silent[::every]) for points, silent, origin in moved]


def _room(seed: int, half_m: float) -> list[MapScan]:
    rng = np.random.default_rng(seed)
    origins = rng.uniform(-1.0, 1.0, (4, 3)).astype(np.float32)
    none = np.zeros((0, 3), dtype=np.float32)
    return [MapScan(room_scan(rng, 2500, half_m, origin.astype(np.float64)), origin, none) for origin in origins]


def _simulated(views: bool, every: int) -> list[MapScan]:
    from rayvox import simulation

    captures = (
        [capture.scan for capture in simulation.benchmark_views().values()]
        if views
        else list(simulation.benchmark_sweeps().values())
    )
    return _in_map([PosedScan(s.points, s.T_map_sensor, no_return=s.no_return) for s in captures], every)


EQUALITY_INPUTS = (
    EqualityInput("sensorscalib_static", 0.2, lambda: _in_map(datasets.sensorscalib_static()[:3], 16)),
    EqualityInput("pointmatcher_car", 0.2, lambda: _in_map(datasets.pointmatcher_car())),
    EqualityInput("smallgicp_pair", 0.2, lambda: _in_map(datasets.smallgicp_pair())),
    EqualityInput("octomap_scan", 0.1, lambda: _in_map(datasets.octomap_scan())),
    EqualityInput("octomap_scan_cut_at_8_m", 0.1, lambda: _in_map(datasets.octomap_scan()), 8.0),
    EqualityInput("octomap_spherical", 0.05, lambda: _in_map(datasets.octomap_spherical())),
    EqualityInput("radish_intel", 0.05, lambda: _in_map(datasets.radish_2d("intel", 0, 200)), 40.0),
    EqualityInput("radish_fr079", 0.05, lambda: _in_map(datasets.radish_2d("fr079", 500, 80)), 40.0),
    EqualityInput("redwood_rgbd", 0.05, lambda: _in_map(datasets.redwood_rgbd(3))),
    EqualityInput("redwood_rgbd_at_1_cm", 0.01, lambda: _in_map(datasets.redwood_rgbd(10)[:2])),
    EqualityInput("room", 0.1, lambda: _room(1, 3.987)),
    EqualityInput("room_with_walls_on_cell_faces", 0.125, lambda: _room(2, 2.0)),
    EqualityInput("room_seen_until_it_saturates", 0.1, lambda: _room(3, 1.987) * 4),
    EqualityInput("simulated_depth_views", 0.05, lambda: _simulated(True, 16), 9.99),
    EqualityInput("simulated_lidar_sweeps", 0.2, lambda: _simulated(False, 3), 39.9),
)
