from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.support.bulk_traversal import pack, prepare_rays, scan_cells, unpack
from tests.support.occupancy_oracle import OracleMap
from tests.support.rational_traversal import ray_cells
from tests.support.scenes import lattice_rays, random_rays, room_scan


def scan_by_single_rays(
    origin: NDArray[np.float64],
    points: NDArray[np.float64],
    resolution_m: float,
    max_range_m: float | None = None,
    silent: NDArray[np.float64] | None = None,
) -> tuple[list[tuple[int, ...]], list[tuple[int, ...]]]:
    free: set[tuple[int, ...]] = set()
    occupied: set[tuple[int, ...]] = set()
    rays = [(point, True) for point in points.tolist()]
    rays += [] if silent is None else [(point, False) for point in silent.tolist()]
    for point, returned in rays:
        passed, hit = ray_cells(origin.tolist(), point, resolution_m, max_range_m, returned)
        free.update(passed)
        occupied.update([] if hit is None else [hit])
    return sorted(free - occupied), sorted(occupied)


def as_tuples(packed: NDArray[np.int64]) -> list[tuple[int, ...]]:
    return [tuple(cell) for cell in unpack(packed).tolist()]


def test_packed_cells_come_back_and_keep_their_order() -> None:
    cells = np.array([[-5, 0, 7], [-(2**20), 2**20 - 1, 0], [3, -1, -1], [3, -1, 0]])
    assert (unpack(pack(cells)) == cells).all()
    assert as_tuples(np.sort(pack(cells))) == sorted(map(tuple, cells.tolist()))
    with pytest.raises(OverflowError):
        pack([[2**20, 0, 0]])


@pytest.mark.parametrize("resolution_m", [0.05, 0.1, 1.0])
def test_a_bulk_scan_of_random_rays_equals_single_rays(resolution_m: float) -> None:
    rng = np.random.default_rng(3)
    origins, points = random_rays(rng, 120, 20 * resolution_m)
    silent = random_rays(rng, 30, 20 * resolution_m)[0]
    expected = scan_by_single_rays(origins[0], points, resolution_m, 18 * resolution_m, silent)
    free, occupied = scan_cells(prepare_rays(origins[0], points, resolution_m, 18 * resolution_m, silent))
    assert (as_tuples(free), as_tuples(occupied)) == expected


@pytest.mark.parametrize("seed", range(4))
def test_a_bulk_scan_of_lattice_rays_equals_single_rays(seed: int) -> None:
    origins, points = lattice_rays(np.random.default_rng(seed), 150, 0.25, 8)
    expected = scan_by_single_rays(origins[0], points, 0.25)
    free, occupied = scan_cells(prepare_rays(origins[0], points, 0.25))
    assert (as_tuples(free), as_tuples(occupied)) == expected


def test_a_scan_without_points_has_no_cells() -> None:
    free, occupied = scan_cells(prepare_rays((0, 0, 0), np.zeros((0, 3)), 0.1))
    assert (len(free), len(occupied)) == (0, 0)


def test_the_oracle_map_equals_a_dictionary_of_voxels() -> None:
    rng = np.random.default_rng(11)
    oracle = OracleMap(0.2)
    expected: dict[tuple[int, ...], np.float32] = {}
    for _ in range(4):
        origin = rng.uniform(-0.5, 0.5, 3)
        points = room_scan(rng, 150, 2.0, origin).astype(np.float64)
        oracle.insert_scan(points, origin)
        free, occupied = scan_by_single_rays(origin, points, 0.2)
        for cells, update in ((free, oracle.miss), (occupied, oracle.hit)):
            for cell in cells:
                value = expected.get(cell, np.float32(0)) + update
                expected[cell] = min(max(value, oracle.clamp_min), oracle.clamp_max)
    assert dict(zip(as_tuples(oracle.voxels), oracle.log_odds, strict=True)) == expected


def test_pruned_leaves_expand_to_the_voxels_they_came_from_and_no_eight_siblings_remain() -> None:
    rng = np.random.default_rng(5)
    oracle = OracleMap(0.2)
    points = room_scan(rng, 4000, 2.0, np.zeros(3))
    for _ in range(6):
        oracle.insert_scan(points, np.zeros(3))
    leaves = oracle.leaves()
    voxels, log_odds = leaves.expanded()
    assert len(leaves) < len(voxels)
    assert (voxels == oracle.voxels).all()
    assert (log_odds == oracle.log_odds).all()
    for level in range(1, 17):
        here = leaves.depth == level
        parents = pack((leaves.keys[here] >> (17 - level)) << (17 - level))
        for parent in np.unique(parents):
            values = leaves.log_odds[here][parents == parent]
            assert len(values) < 8 or len(set(values.tolist())) > 1
