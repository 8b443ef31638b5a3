"""How far a map is from the truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rayvox.map_snapshot import MapSnapshot
from rayvox.tune.ground_truth import FloatArray, GroundTruth, NearestPoint, occupied_centres
from rayvox.tune.scene_truth import SAMPLES

_FREE, _OCCUPIED = 1, 2


@dataclass(frozen=True, slots=True)
class MapAccuracy:
    """Shares from 0 to 1, distances in metres.

    occupied_precision: of the occupied voxels, those that hold something solid. occupied_recall: of the points on
    surfaces that were seen, those in an occupied voxel. free_recall: of the points in free space that rays passed,
    those in a free voxel.
    error_*: of two kinds of distances the larger statistic: from the centres of occupied voxels to the nearest true
    surface (stray), and from points on surfaces that were seen to the nearest occupied voxel's centre (gap).
    """

    occupied_precision: float
    occupied_recall: float
    free_recall: float
    error_mean_m: float
    error_p95_m: float
    error_p98_m: float
    error_max_m: float
    stray_p95_m: float
    gap_p95_m: float


def map_accuracy(octree: MapSnapshot, truth: GroundTruth, seed: int = 0) -> MapAccuracy | None:
    """None where nothing is occupied, in the map or in truth: there is nothing to measure."""
    centres = occupied_centres(octree)
    if not len(centres) or not len(truth.seen_surface) or not len(truth.seen_free):
        return None
    sample = centres[np.random.default_rng(seed).permutation(len(centres))[:SAMPLES]]
    stray_m = truth.distance_m(sample)
    gap_m = NearestPoint(centres).distance_m(truth.seen_surface)
    mean, p95, p98, most = (max(of(stray_m), of(gap_m)) for of in (_mean, _p95, _p98, _max))
    return MapAccuracy(
        occupied_precision=float(truth.holds_surface(sample, octree.resolution_m).mean()),
        occupied_recall=float((octree.states_at(truth.seen_surface) == _OCCUPIED).mean()),
        free_recall=float((octree.states_at(truth.seen_free) == _FREE).mean()),
        error_mean_m=mean,
        error_p95_m=p95,
        error_p98_m=p98,
        error_max_m=most,
        stray_p95_m=_p95(stray_m),
        gap_p95_m=_p95(gap_m),
    )


def _mean(distances_m: FloatArray) -> float:
    return float(distances_m.mean())


def _p95(distances_m: FloatArray) -> float:
    return float(np.quantile(distances_m, 0.95))


def _p98(distances_m: FloatArray) -> float:
    return float(np.quantile(distances_m, 0.98))


def _max(distances_m: FloatArray) -> float:
    return float(distances_m.max())
