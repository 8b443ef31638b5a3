"""The settings of a map whose trade is measured, and in what order."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from rayvox.occupancy_map import ENGINES, Engine
from rayvox.tune.scan_input import Part, PosedScan

OCTOMAP_DEPTH, MOST_DEPTH = 16, 21
# Resolutions tried, as multiples of the error that is allowed: a voxel's centre lies within 0.87 edges of its content.
_LADDER = (4.0, 2.0, 1.5, 1.0, 0.75, 0.5)
_SHARES = (1.0, 0.5, 0.25)
# Of the longest measurements, outliers left out.
_RANGE_SHARES, _LONGEST = (0.75, 0.5), 0.995


@dataclass(frozen=True, slots=True)
class MapSettings:
    """How scans become a map.

    max_range_m: longer rays are cut there; None cuts only where the scan does. ray_share: share of the rays that are
    inserted (ray_sampling.kept_rays). discretize: one ray per end-point voxel. depth and engine change no leaf.
    """

    resolution_m: float
    max_range_m: float | None = None
    ray_share: float = 1.0
    discretize: bool = False
    depth: int = OCTOMAP_DEPTH
    engine: Engine = "auto"

    def __str__(self) -> str:
        words = [f"{100 * self.resolution_m:.3g} cm"]
        if self.max_range_m is not None:
            words.append(f"cut at {self.max_range_m:.3g} m")
        if self.ray_share < 1:
            words.append(f"1/{1 / self.ray_share:.3g} of the rays")
        if self.discretize:
            words.append("discretize")
        if self.depth != OCTOMAP_DEPTH:
            words.append(f"{self.depth} levels")
        if self.engine != "auto":
            words.append(self.engine)
        return ", ".join(words)


def resolution_ladder(
    max_error_m: float, parts: Sequence[Part], resolutions_m: Sequence[float] | None = None
) -> list[MapSettings]:
    """Coarse to fine, everything else as it comes; more levels than OctoMap's only where the scans reach farther."""
    chosen = [float(f"{r:.3g}") for r in resolutions_m or [factor * max_error_m for factor in _LADDER]]
    return [
        MapSettings(r, depth=max(OCTOMAP_DEPTH, fewest_levels(r, parts))) for r in sorted(set(chosen), reverse=True)
    ]


def range_cuts(parts: Sequence[Part]) -> list[float | None]:
    """No cut, and cuts at shares of the longest measurements."""
    lengths = np.concatenate([np.linalg.norm(scan.points, axis=1) for part in parts for scan in part.scans])
    longest_m = float(np.quantile(lengths, _LONGEST))
    return [None, *(float(f"{share * longest_m:.2g}") for share in _RANGE_SHARES)]


def one_factor_at_a_time(base: MapSettings, cuts: Sequence[float | None]) -> list[MapSettings]:
    """What each factor does by itself."""
    return [
        *(replace(base, ray_share=share) for share in _SHARES[1:]),
        *(replace(base, max_range_m=cut) for cut in cuts[1:]),
        replace(base, discretize=True),
    ]


def interacting_factors(resolutions: Sequence[MapSettings], useful: Sequence[MapSettings]) -> list[MapSettings]:
    """The factors of `useful` settings in all combinations: each takes rays that another might have taken.

    useful: those of one_factor_at_a_time that gained something by themselves; others are not worth combining.
    """
    shares = {1.0, *(one.ray_share for one in useful)}
    cuts = {None, *(one.max_range_m for one in useful)}
    discretized = {False, *(one.discretize for one in useful)}
    return [
        replace(base, ray_share=share, max_range_m=cut, discretize=discretize)
        for base, share, cut, discretize in product(
            resolutions,
            sorted(shares, reverse=True),
            sorted(cuts, key=lambda cut: -(cut or math.inf)),
            sorted(discretized),
        )
    ]


def with_same_leaves(base: MapSettings, parts: Sequence[Part]) -> list[MapSettings]:
    """Engines and depths: the same leaves, so that only times need measuring."""
    engines = [replace(base, engine=engine) for engine in ENGINES if engine != "auto"]
    fewest = fewest_levels(base.resolution_m, parts)
    return [*engines, *(replace(base, depth=depth) for depth in {fewest, MOST_DEPTH} - {base.depth})]


def fewest_levels(resolution_m: float, parts: Sequence[Part]) -> int:
    """Levels below which coordinates of these scans would lie beyond the octree, with as much room again."""
    farthest_m = max(_farthest_m(scan) for part in parts for scan in part.scans)
    return min(MOST_DEPTH, max(4, math.ceil(math.log2(2 * farthest_m / resolution_m)) + 1))


def _farthest_m(scan: PosedScan) -> float:
    """Largest coordinate that a ray of this length can reach, whatever its direction."""
    rays = [scan.points] if scan.no_return is None else [scan.points, scan.no_return]
    longest_m = max(float(np.linalg.norm(ends, axis=1).max(initial=0.0)) for ends in rays)
    return float(np.abs(scan.T_map_sensor[:3, 3]).max()) + longest_m
