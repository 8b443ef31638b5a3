"""Rays cast through a map against OctoMap's castRay and against a walk along the oracle's cells."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Literal

import numpy as np
import pytest
import rayvox
from rayvox import simulation

from tests.support.octomap_peer import OctomapPeer
from tests.support.rational_traversal import passed_cells

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
    agreed = ties = at_range = 0
    for index, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        end = np.zeros(3)
        found = theirs.tree.castRay(origin.astype(np.float64), direction.astype(np.float64), end, True, RANGE_M)
        voxel = np.floor(np.asarray(end) / RESOLUTION_M).astype(np.int64)
        hit = hits.hit[index] == 1
        if bool(found) == hit and (not found or (voxel == hits.voxel[index]).all()):
            agreed += 1
        elif bool(found) != hit and ends_by_voxel_centres(origin, direction, hits.voxel[index], voxel, hit):
            at_range += 1
        else:
            ties += 1
            assert touches(origin, direction, hits.voxel[index], voxel), index
    print(f"{len(origins)} rays: {agreed} the same, {ties} explained ties, {at_range} end by voxel centres")
    assert agreed > 0.99 * len(origins)
    assert (hits.hit == 1).sum() > 500


def ends_by_voxel_centres(
    origin: np.ndarray, direction: np.ndarray, ours: np.ndarray, theirs: np.ndarray, hit: bool
) -> bool:
    """Whether the range ends a ray for one of the two only: OctoMap goes on until a voxel's centre lies beyond it."""

    def centre_m(cell: np.ndarray) -> float:
        return float(np.linalg.norm((cell + 0.5) * RESOLUTION_M - origin))

    if not hit:
        return entered_m(origin, direction, theirs) > RANGE_M - 1e-4 and centre_m(theirs) < RANGE_M + 1e-4
    unit = direction.astype(np.float64) / np.linalg.norm(direction.astype(np.float64))
    end = origin.astype(np.float64) + unit * RANGE_M
    passed = np.array(passed_cells((origin / RESOLUTION_M).tolist(), (end / RESOLUTION_M).tolist()))
    before = passed[: np.flatnonzero((passed == ours).all(axis=1))[0] + 1]
    return max(map(centre_m, before)) > RANGE_M - 1e-4


def entered_m(origin: np.ndarray, direction: np.ndarray, voxel: np.ndarray) -> float:
    """Distance along the ray to where it enters the voxel."""
    low, unit = voxel * RESOLUTION_M, direction / np.linalg.norm(direction.astype(np.float64))
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - origin) / unit, (low + RESOLUTION_M - origin) / unit
    return float(np.nanmax(np.minimum(a, b)))


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


@pytest.mark.parametrize("engine", ["masks", "embree", "auto"])
@pytest.mark.parametrize(("resolution_m", "spread"), [(1.0, 12), (0.05, 30), (0.001, 400), (10.0, 20_000)])
def test_every_engine_gives_the_octrees_answers(
    resolution_m: float, spread: int, engine: Literal["masks", "embree", "auto"]
) -> None:
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
    snapshot = cubes.snapshot()
    unknown: Literal["free", "occupied"]
    for unknown in ("free", "occupied"):
        for max_range_m in (None, spread * resolution_m):
            if engine == "embree" and unknown == "occupied":
                continue
            by_octree = snapshot.cast_rays(origins, directions, max_range_m, unknown, engine="octree")
            other = snapshot.cast_rays(origins, directions, max_range_m, unknown, engine=engine)
            assert (other.hit == by_octree.hit).all()
            assert (other.voxel == by_octree.voxel).all()
            np.testing.assert_allclose(other.t_m, by_octree.t_m, rtol=1e-14)
            assert (by_octree.hit == 1).sum() > 100


def test_masks_give_the_octrees_answers_in_a_building() -> None:
    occupancy_map, _ = building_maps()
    snapshot, rng = occupancy_map.snapshot(), np.random.default_rng(21)
    origins = rng.uniform((-12, -7, -0.5), (12, 7, 3.5), (60_000, 3))
    directions = rng.normal(size=origins.shape)
    directions[::7, 1] = 0
    directions[::11, 0] *= 1e-12
    unknown: Literal["free", "occupied"]
    for unknown in ("free", "occupied"):
        by_octree = snapshot.cast_rays(origins, directions, None, unknown, engine="octree")
        by_masks = snapshot.cast_rays(origins, directions, None, unknown, engine="masks")
        assert (by_masks.hit == by_octree.hit).all()
        assert (by_masks.voxel == by_octree.voxel).all()
        np.testing.assert_allclose(by_masks.t_m, by_octree.t_m, rtol=1e-14)
        assert len(np.unique(by_octree.hit)) == 2


def test_threads_that_ask_one_snapshot_at_once_share_its_masks_and_get_the_same_answers() -> None:
    rng = np.random.default_rng(5)
    snapshot = cubes_map(rng, 0.1, 20).snapshot()
    origins, directions = rng.uniform(-2, 2, (20_000, 3)), rng.normal(size=(20_000, 3))
    expected = snapshot.cast_rays(origins, directions, engine="octree")
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: snapshot.cast_rays(origins, directions), range(16)))
    assert all((answer.voxel == expected.voxel).all() for answer in answers)


def test_embree_scenes_hold_no_unknown_space() -> None:
    with pytest.raises(rayvox.InvalidInputError, match="unknown='free'"):
        rayvox.OccupancyMap(0.1).cast_rays([0, 0, 0], [[1, 0, 0]], engine="embree", unknown="occupied")
