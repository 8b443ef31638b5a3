"""The same scans through OctoMap, rayvox and the exact oracle.

rayvox's leaves must be the oracle's, all of them. OctoMap may differ from the oracle only at voxels where a ray
touches an edge, a corner or a face, or comes so near that OctoMap's float32 directions decide: those are counted, the
rest are failures.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rayvox
from numpy.typing import NDArray

from tests.support.bulk_traversal import prepare_rays
from tests.support.datasets import PUBLISHED_MAPS, PublishedMap, data_path
from tests.support.equality_inputs import EQUALITY_INPUTS, EqualityInput
from tests.support.leaf_comparison import assert_same_leaves, compare_leaves
from tests.support.occupancy_oracle import Leaves, OracleMap
from tests.support.octomap_peer import OctomapPeer, parse_ot
from tests.support.rational_traversal import to_voxel_units
from tests.support.rayvox_maps import insert_map_scan, leaves_of
from tests.support.tie_report import ExactScan, explain_difference


@pytest.mark.parametrize("case", EQUALITY_INPUTS, ids=lambda case: case.name)
def test_the_map_equals_octomaps_but_for_explained_ties(
    case: EqualityInput, record_property: Callable[[str, object], None]
) -> None:
    scans = case.load()
    ours = rayvox.OccupancyMap(case.resolution_m)
    theirs = OctomapPeer(case.resolution_m)
    oracle = OracleMap(case.resolution_m)
    exact = []
    for scan in scans:
        insert_map_scan(ours, scan, case.max_range_m)
        theirs.insert_scan(scan.all_ends, scan.origin, case.max_range_m)
        rays = prepare_rays(scan.origin, scan.points, case.resolution_m, case.max_range_m, scan.no_return)
        exact.append(ExactScan(rays))
        oracle.insert_cells(exact[-1].free, exact[-1].occupied)

    truth = oracle.leaves()
    assert_same_leaves(leaves_of(ours), truth)

    difference = compare_leaves(truth, theirs.leaves())
    counts = explain_difference(difference, exact, oracle)
    ties = {"exact": counts["exact"], "near": counts["near"]}
    print(f"{case.name}: {len(truth)} leaves, {len(oracle.voxels)} voxels, OctoMap differs in {ties} ties")
    record_property("ties", ties)
    assert counts["unexplained"] == 0
    assert difference.unaccounted_leaves == 0


@pytest.mark.parametrize("name", ["octomap_scan", "room"])
def test_a_discretized_scan_equals_octomaps_but_for_explained_ties(name: str) -> None:
    case = next(case for case in EQUALITY_INPUTS if case.name == name)
    scan, resolution_m = case.load()[0], case.resolution_m
    points = scan.points[::15]
    ours, theirs, oracle = rayvox.OccupancyMap(resolution_m), OctomapPeer(resolution_m), OracleMap(resolution_m)
    ours.insert_scan(points, origin=tuple(scan.origin.tolist()), discretize=True)
    theirs.insert_scan(points, scan.origin, discretize=True)

    cells = np.unique(np.floor(to_voxel_units(points, resolution_m)), axis=0)
    rays = prepare_rays(scan.origin, (cells + 0.5) * resolution_m, resolution_m)
    # OctoMap rounds the voxels' centres to float32, as it rounds the new end of a ray that it cuts.
    exact = ExactScan(replace(rays, cut=np.ones_like(rays.cut)))
    oracle.insert_cells(exact.free, exact.occupied)

    truth = oracle.leaves()
    assert_same_leaves(leaves_of(ours), truth)
    difference = compare_leaves(truth, theirs.leaves())
    counts = explain_difference(difference, [exact], oracle)
    print(f"{name}, discretized: {len(truth)} leaves, OctoMap differs in {dict(counts)} ties")
    assert counts["unexplained"] == 0
    assert difference.unaccounted_leaves == 0


def spherical_map() -> tuple[rayvox.OccupancyMap, OctomapPeer]:
    rng = np.random.default_rng(17)
    ours, theirs = rayvox.OccupancyMap(0.1), OctomapPeer(0.1)
    for origin in rng.uniform(-0.7, 0.7, (5, 3)).astype(np.float32):
        directions = rng.normal(size=(3000, 3))
        reach = rng.uniform(1.0, 2.0, (3000, 1))
        points = (origin + directions / np.linalg.norm(directions, axis=1, keepdims=True) * reach).astype(np.float32)
        ours.insert_scan(points, origin=tuple(origin.tolist()))
        theirs.insert_scan(points, origin)
    return ours, theirs


@pytest.mark.parametrize("suffix", [".ot", ".bt"])
def test_octomap_reads_what_rayvox_wrote_with_the_same_leaves(suffix: str, tmp_path: Path) -> None:
    ours, _ = spherical_map()
    path = tmp_path / f"map{suffix}"
    ours.save(path)
    read_by_octomap = OctomapPeer.read(path).leaves()
    if suffix == ".ot":
        assert_same_leaves(read_by_octomap, leaves_of(ours))
    else:
        assert_same_leaves(read_by_octomap, leaves_of(rayvox.OccupancyMap.load(path)))
        occupied = leaves_of(ours).log_odds >= 0
        assert (read_by_octomap.log_odds >= 0).any() == occupied.any()


@pytest.mark.parametrize("suffix", [".ot", ".bt"])
def test_rayvox_reads_what_octomap_wrote_and_writes_it_back_byte_for_byte(suffix: str, tmp_path: Path) -> None:
    _, theirs = spherical_map()
    written = theirs.ot_bytes() if suffix == ".ot" else theirs.bt_bytes()
    first, second = tmp_path / f"theirs{suffix}", tmp_path / f"ours{suffix}"
    first.write_bytes(written)
    loaded = rayvox.OccupancyMap.load(first)
    assert_same_leaves(leaves_of(loaded), OctomapPeer.read(first).leaves())
    loaded.save(second)
    assert second.read_bytes() == written


def test_the_maximum_likelihood_file_has_the_states_of_the_map(tmp_path: Path) -> None:
    ours, theirs = spherical_map()
    ours.save(tmp_path / "ours.bt")
    (tmp_path / "theirs.bt").write_bytes(theirs.bt_bytes())
    written_by_us = OctomapPeer.read(tmp_path / "ours.bt").leaves()
    written_by_them = OctomapPeer.read(tmp_path / "theirs.bt").leaves()
    difference = compare_leaves(written_by_us, written_by_them)
    # Ties of the insertion remain ties here; anything more is the file's fault.
    assert len(difference.cells) <= len(compare_leaves(leaves_of(ours), spherical_map()[1].leaves()).cells)
    assert difference.unaccounted_leaves == 0


def volume_m3(leaves: Leaves, chosen: NDArray[np.bool_], resolution_m: float) -> float:
    edge = resolution_m * 2.0 ** (leaves.tree_depth - leaves.depth[chosen].astype(np.float64))
    return float((edge**3).sum())


def published_bt(published: PublishedMap, tmp_path: Path) -> Path:
    """The file under a `.bt` name: one of them is published as `.octree`."""
    path = tmp_path / "published.bt"
    path.write_bytes(data_path(published.path).read_bytes())
    return path


@pytest.mark.parametrize("published", PUBLISHED_MAPS, ids=lambda published: published.path)
def test_a_published_map_loads_with_its_leaf_counts_and_volumes(published: PublishedMap, tmp_path: Path) -> None:
    loaded = rayvox.OccupancyMap.load(published_bt(published, tmp_path))
    leaves = leaves_of(loaded)
    occupied = leaves.log_odds >= 0
    assert loaded.resolution_m == published.resolution_m
    assert (int(occupied.sum()), int((~occupied).sum())) == (published.occupied_leaves, published.free_leaves)
    assert volume_m3(leaves, ~occupied, published.resolution_m) == pytest.approx(published.free_volume_m3, abs=5e-5)
    if published.occupied_volume_m3 is not None:
        volume = volume_m3(leaves, occupied, published.resolution_m)
        assert volume == pytest.approx(published.occupied_volume_m3, abs=5e-5)
    statistics = loaded.snapshot().statistics()
    assert (statistics.occupied_leaves, statistics.free_leaves) == (published.occupied_leaves, published.free_leaves)
    assert statistics.nodes == published.nodes


@pytest.mark.parametrize("published", PUBLISHED_MAPS, ids=lambda published: published.path)
def test_a_published_map_goes_through_rayvox_byte_for_byte(published: PublishedMap, tmp_path: Path) -> None:
    source = published_bt(published, tmp_path)
    written = tmp_path / "written.bt"
    rayvox.OccupancyMap.load(source).save(written)
    original, ours = source.read_bytes(), written.read_bytes()
    # Comments of the text header are the writer's own; everything that follows it is the map.
    assert ours[ours.index(b"\ndata\n") :] == original[original.index(b"\ndata\n") :]
    assert OctomapPeer.read(written).tree.calcNumNodes() == published.nodes


@pytest.mark.parametrize("published", PUBLISHED_MAPS[:2], ids=lambda published: published.path)
def test_a_published_map_saved_as_full_tree_equals_octomaps_full_tree(published: PublishedMap, tmp_path: Path) -> None:
    source = published_bt(published, tmp_path)
    written = tmp_path / "full.ot"
    rayvox.OccupancyMap.load(source).save(written)
    theirs = OctomapPeer.read(source).ot_bytes()
    assert_same_leaves(parse_ot(written.read_bytes()), parse_ot(theirs))
    ours = written.read_bytes()
    assert ours[ours.index(b"\ndata\n") :] == theirs[theirs.index(b"\ndata\n") :]
