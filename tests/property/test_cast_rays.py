"""Rays cast through a map against OctoMap's castRay and against a walk along the oracle's cells."""

from __future__ import annotations

import numpy as np
import pytest
import rayvox
from rayvox import simulation

from tests.support.octomap_peer import OctomapPeer

RESOLUTION_M = 0.1
RANGE_M = 8.0


def building_maps() -> tuple[rayvox.OccupancyMap, OctomapPeer]:
    """The same scans in both, with float32 rays."""
    lens = simulation.DepthCamera(simulation.Intrinsics(80, 60, 50.0, 50.0, 39.5, 29.5))
    ours, theirs = rayvox.OccupancyMap(RESOLUTION_M), OctomapPeer(RESOLUTION_M)
    for view in simulation.benchmark_views(lens).values():
        pose = view.scan.T_map_sensor
        ends = (view.scan.points.astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)
        origin = pose[:3, 3].astype(np.float32)
        ours.insert_scan(ends, origin=tuple(origin.tolist()))
        theirs.insert_scan(ends, origin)
    return ours, theirs


def test_first_hits_equal_octomaps_but_for_explained_ties() -> None:
    ours, theirs = building_maps()
    rng = np.random.default_rng(8)
    origins = rng.uniform((-9, -5, 0.2), (9, 5, 2.2), (6000, 3)).astype(np.float32)
    origins = origins[ours.states_at(origins) == 1]
    directions = rng.normal(size=origins.shape).astype(np.float32)
    hits = ours.cast_rays(origins, directions, RANGE_M, unknown="free")
    agreed = ties = 0
    for index, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        end = np.zeros(3)
        found = theirs.tree.castRay(origin.astype(np.float64), direction.astype(np.float64), end, True, RANGE_M)
        voxel = np.floor(np.asarray(end) / RESOLUTION_M).astype(np.int64)
        # OctoMap ends a ray by the distance of voxel centres: at the range's end the two may differ by one voxel.
        at_the_end = hits.hit[index] == 0 or hits.t_m[index] > RANGE_M - 2 * RESOLUTION_M
        if bool(found) == (hits.hit[index] == 1) and (not found or (voxel == hits.voxel[index]).all()):
            agreed += 1
        elif not at_the_end:
            ties += 1
            assert touches(origin, direction, hits.voxel[index], voxel), index
    at_range = len(origins) - agreed - ties
    print(f"{len(origins)} rays: {agreed} the same, {ties} explained ties, {at_range} at the range's end")
    assert agreed > 0.99 * len(origins)
    assert (hits.hit == 1).sum() > 500


def touches(origin: np.ndarray, direction: np.ndarray, ours: np.ndarray, theirs: np.ndarray) -> bool:
    """Whether the ray passes one of two voxels within float32's rounding of an edge or a corner."""
    for voxel in (ours, theirs):
        low, unit = voxel * RESOLUTION_M, direction / np.linalg.norm(direction.astype(np.float64))
        with np.errstate(divide="ignore", invalid="ignore"):
            a, b = (low - origin) / unit, (low + RESOLUTION_M - origin) / unit
        if abs(np.nanmax(np.minimum(a, b)) - np.nanmin(np.maximum(a, b))) < 1e-4:
            return True
    return False


def cubes_map(rng: np.random.Generator, resolution_m: float, spread: int) -> rayvox.OccupancyMap:
    """Occupied voxels and, once saturated, some larger occupied leaves."""
    occupied = rayvox.OccupancyMap(resolution_m)
    corners = rng.integers(-spread, spread, (60, 3))
    block = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = np.concatenate([corners, (corners[:6, None] // 4 * 4 + block[None]).reshape(-1, 3)])
    for cell in (cells + 0.5) * resolution_m:
        for _ in range(6):
            occupied.insert_scan([cell], origin=tuple(cell.tolist()))
    return occupied


@pytest.mark.parametrize(("resolution_m", "spread"), [(1.0, 12), (0.05, 30), (0.001, 400), (10.0, 20_000)])
def test_embree_gives_the_octrees_answers(resolution_m: float, spread: int) -> None:
    rng = np.random.default_rng(spread)
    cubes = cubes_map(rng, resolution_m, spread)
    keys, _, log_odds = cubes.leaves()
    targets = keys[log_odds > 0]
    # Lattice points: rays along faces, through edges and corners, from inside an occupied voxel.
    origins = rng.integers(-2 * spread, 2 * spread, (4000, 3)) / 2.0
    origins[:200] = targets[rng.integers(len(targets), size=200)] + 0.5
    aims = targets[rng.integers(len(targets), size=4000)] + rng.integers(0, 3, (4000, 3)) / 2.0
    aims[2000:] += rng.normal(size=(2000, 3))
    directions = aims - origins
    moving = np.abs(directions).max(axis=1) > 0
    origins, directions = origins[moving] * resolution_m, directions[moving] * resolution_m
    for max_range_m in (None, spread * resolution_m):
        by_octree = cubes.cast_rays(origins, directions, max_range_m, engine="octree")
        by_embree = cubes.cast_rays(origins, directions, max_range_m, engine="embree")
        assert (by_embree.hit == by_octree.hit).all()
        assert (by_embree.voxel == by_octree.voxel).all()
        np.testing.assert_allclose(by_embree.t_m, by_octree.t_m, rtol=1e-14)
        assert (by_octree.hit == 1).sum() > 100


def test_embree_scenes_hold_no_unknown_space() -> None:
    with pytest.raises(rayvox.InvalidInputError, match="unknown='free'"):
        rayvox.OccupancyMap(0.1).cast_rays([0, 0, 0], [[1, 0, 0]], engine="embree", unknown="occupied")
