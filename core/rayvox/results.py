"""What the map answers with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt


@dataclass(frozen=True)
class ScanStatistics:
    """What one insertion did.

    voxel_steps counts the cells walked, each ray alone (the Embree engine walks only those that a ray could still
    change); voxels_changed those whose log-odds changed or that became known. bvh_node_count: boxes in the Embree
    engine's scene, bvh_s: the time to bring it up to date; 0 for other engines.
    Times are seconds of wall-clock; shoot_s and update_s are summed over threads and divided by their number.
    """

    engine: str
    ray_count: int
    voxel_steps: int
    tile_count: int
    brick_count: int
    voxels_changed: int
    bvh_node_count: int
    bvh_s: float
    cut_s: float
    shoot_s: float
    update_s: float
    total_s: float


@dataclass(frozen=True)
class ScanResult:
    """The map's revision after an insertion, and what it did."""

    revision: int
    statistics: ScanStatistics


@dataclass(frozen=True)
class RayHits:
    """Answers to n rays.

    hit: (n,) uint8, 0 nothing, 1 occupied voxel, 2 unknown space entered.
    t_m: (n,) float64, metres from the origin to where the ray enters the voxel; the ray's length where nothing was met.
    voxel: (n, 3) int64, finest-level cell entered; the last one where nothing was met.
    """

    hit: npt.NDArray[np.uint8]
    t_m: npt.NDArray[np.float64]
    voxel: npt.NDArray[np.int64]


@dataclass(frozen=True)
class ChangeSet:
    """What changed from revision `since` (exclusive) to `revision`.

    What a copy at `since` holds inside each region is void (with `full`: everything it holds), and replaced by the
    leaves.
    region_keys (m, 3) int64 and region_depth (m,) uint8: octree nodes, by lowest finest-level cell and depth.
    keys (n, 3) int64, leaf_depth (n,) uint8, log_odds (n,) float32: the leaves the regions hold now.
    """

    since: int
    revision: int
    full: bool
    region_keys: npt.NDArray[np.int64]
    region_depth: npt.NDArray[np.uint8]
    keys: npt.NDArray[np.int64]
    leaf_depth: npt.NDArray[np.uint8]
    log_odds: npt.NDArray[np.float32]


@dataclass(frozen=True)
class MapStatistics:
    """Counts over a map's leaves; `nodes` counts leaves and inner nodes as OctoMap does, bounds are None for an empty
    map."""

    occupied_leaves: int
    free_leaves: int
    nodes: int
    occupied_volume_m3: float
    free_volume_m3: float
    nbytes: int
    bounds_lo_m: tuple[float, float, float] | None
    bounds_hi_m: tuple[float, float, float] | None
