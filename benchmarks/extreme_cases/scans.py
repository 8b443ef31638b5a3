"""Scans at the extremes, through every engine, against the exact traversal; OctoMap on the same scans."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import rayvox
from numpy.typing import NDArray

from benchmarks.extreme_cases.case import Case, Outcome, PeerOutcome
from tests.support.leaf_comparison import compare_leaves
from tests.support.occupancy_oracle import Leaves, OracleMap
from tests.support.octomap_peer import OctomapPeer
from tests.support.rational_traversal import to_voxel_units
from tests.support.rayvox_maps import leaves_of

FloatArray = NDArray[np.float64]
SAME_LEAVES = "leaves and log-odds are those of the exact traversal, bit for bit"
_OCTOMAP_DEPTH = 16
_ENGINES = [name for name in rayvox.ENGINES if name != "auto"]


@dataclass(frozen=True)
class Scan:
    """Rays in the map frame: origin (3,), ends (n, 3) of hits, reaches (k, 3) of rays without return."""

    origin: FloatArray
    points: FloatArray
    no_return: FloatArray | None = None


@dataclass(frozen=True)
class ScanInput:
    """Scans for one map."""

    scans: list[Scan]
    resolution_m: float
    depth: int = _OCTOMAP_DEPTH

    def truth(self) -> OracleMap:
        oracle = OracleMap(self.resolution_m, tree_depth=self.depth)
        for scan in self.scans:
            silent = None if scan.no_return is None else scan.origin + scan.no_return
            oracle.insert_scan(scan.points, scan.origin, no_return_m=silent)
        return oracle

    def fits_octomap(self) -> bool:
        half = self.resolution_m * 2 ** (_OCTOMAP_DEPTH - 1)
        return all(np.abs(np.vstack([s.origin, s.points])).max(initial=0) < half for s in self.scans)


def wrong_voxels(found: Leaves, truth: Leaves) -> int:
    """Voxels whose log-odds differ by more than rounding could, or leaves of another size."""
    try:
        difference = compare_leaves(found, truth)
    except AssertionError:  # too many voxels differ to be listed
        return len(truth)
    return len(difference.cells) + difference.unaccounted_leaves


def largest_difference(found: Leaves, truth: Leaves) -> float:
    """Of the log-odds of the same leaves; infinite where the leaves differ."""
    if len(found) != len(truth) or (found.keys != truth.keys).any():
        return np.inf
    return float(np.abs(found.log_odds.astype(np.float64) - truth.log_odds).max(initial=0.0))


def ours(load: Callable[[], ScanInput]) -> Outcome:
    """Every engine against the oracle: voxels wrong, and the largest difference of log-odds."""
    given = load()
    oracle = given.truth()
    truth, wrong, worst = oracle.leaves(), 0, 0.0
    for engine in _ENGINES:
        found = rayvox.OccupancyMap(given.resolution_m, given.depth)
        for scan in given.scans:
            origin = tuple(scan.origin.tolist())
            found.insert_scan(scan.points, origin=origin, no_return=scan.no_return, engine=engine)
        wrong += wrong_voxels(leaves_of(found), truth)
        worst = max(worst, largest_difference(leaves_of(found), truth))
    return Outcome(len(_ENGINES) * len(oracle.voxels), wrong, worst)


def octomaps(load: Callable[[], ScanInput]) -> PeerOutcome:
    """OctoMap's voxels against the oracle's, in a tree of its 16 levels; rays without return are left out."""
    given = load()
    if not given.fits_octomap():
        return "beyond its 16 levels"
    given = replace(given, depth=_OCTOMAP_DEPTH, scans=[replace(scan, no_return=None) for scan in given.scans])
    given = replace(given, scans=[scan for scan in given.scans if len(scan.points)])
    oracle, theirs = given.truth(), OctomapPeer(given.resolution_m)
    for scan in given.scans:
        theirs.insert_scan(scan.points, scan.origin)
    return Outcome(len(oracle.voxels), wrong_voxels(theirs.leaves(), oracle.leaves()))


def scan_case(topic: str, name: str, load: Callable[[], ScanInput], must_hold: str = SAME_LEAVES) -> Case:
    return Case(topic, name, must_hold, lambda: ours(load), peers={"OctoMap": lambda: octomaps(load)})


def _random_scan(seed: int, reach_m: float, centre: FloatArray, count: int = 300) -> Scan:
    rng = np.random.default_rng(seed)
    origin, *points = centre + rng.uniform(-reach_m, reach_m, (count + 1, 3))
    return Scan(origin, np.array(points), rng.uniform(-reach_m, reach_m, (20, 3)))


def _moved(offset_m: float, resolution_m: float, depth: int) -> ScanInput:
    centre = np.array([offset_m, -offset_m, offset_m / 3])
    return ScanInput([_random_scan(1, 30 * resolution_m, centre)], resolution_m, depth)


def _of_resolution(resolution_m: float) -> ScanInput:
    return ScanInput([_random_scan(2, 40 * resolution_m, np.zeros(3))], resolution_m)


def _at_the_border(depth: int) -> ScanInput:
    """Rays to the octree's outermost cells, in two opposite corners, and across where that is not too far."""
    half = 2.0 ** (depth - 1)
    reach = min(half, 400.0)
    rng = np.random.default_rng(depth)
    last = np.nextafter(half, 0)
    scans = []
    for corner, to in ((-half, 1), (last, -1)):
        ends = corner + to * rng.uniform(0, reach * 0.9, (40, 3))
        ends[:3, :] = np.where(np.eye(3) == 1, corner, ends[:3, :])
        scans.append(Scan(corner + to * rng.uniform(0, reach * 0.9, 3), ends))
    if depth <= 14:
        scans.append(Scan(np.full(3, -half), np.array([[last, last, last], [last, -half, 0.5]])))
    return ScanInput(scans, 1.0, depth)


def _beyond_the_border(depth: int) -> Outcome:
    """Coordinates just outside are refused with OutOfRangeError, and nothing changes."""
    half, wrong = 2.0 ** (depth - 1), 0
    outside = [half, np.nextafter(-half, -np.inf), 1e300]
    for value in outside:
        occupancy_map = rayvox.OccupancyMap(1.0, depth)
        try:
            occupancy_map.insert_scan(np.array([[0.5, value, 0.5]]))
            wrong += 1
        except rayvox.OutOfRangeError:
            wrong += occupancy_map.revision != 0
    return Outcome(len(outside), wrong)


def _of_length(voxels: int) -> ScanInput:
    """Rays of so many voxels: along an axis, a diagonal of a face and of space, and at random."""
    if voxels == 0:
        spots = np.array([[0.5, 0.5, 0.5], [1.0, -1.0, 0.0], [0.0, 0.0, 0.0], [-3.25, 7.0, 1e-300]])
        return ScanInput([Scan(s, s[None], np.zeros((1, 3))) for s in spots], 1.0)
    rng = np.random.default_rng(voxels)
    random = rng.normal(size=3)
    steps = np.array([[-1, 0, 0], [0, 0.5, 0.5], [1 / 3, -1 / 3, 1 / 3], random / np.abs(random).sum()])
    return ScanInput([Scan(np.zeros(3), steps * voxels)], 1.0, 18)


def _on_faces(offset: str, resolution_m: float) -> ScanInput:
    """Rays along the axes and nearly along them, in cell faces and edges or so far beside them."""
    scans = []
    for plane in (-3.0, 0.0, 2.0, 7.0):
        beside = {
            "0": [0.0],
            "1 ulp": [np.nextafter(plane, np.inf) - plane, np.nextafter(plane, -np.inf) - plane],
            "1e-12": [1e-12, -1e-12],
        }[offset]
        for by in beside:
            for axis in range(3):
                start = np.array([0.5, 0.25, -4.75])
                start[axis] = plane + by
                ends = start + 9.0 * np.array([[1, 0, 0], [0, -1, 0], [0, 0, 1], [1, 1, 0], [-1, 0, 1], [0, 1, -1]])
                level = ends.copy()
                level[:, axis] = plane + by  # stays beside the face
                through = ends.copy()
                through[:, axis] = plane - by  # grazes it
                corner = np.full(3, plane + by)
                scans.append(Scan(start * resolution_m, np.concatenate([level, through, ends]) * resolution_m))
                scans.append(Scan(corner * resolution_m, (corner + np.sign(ends) * 5.0) * resolution_m))
    return ScanInput(scans, resolution_m)


def _denormal() -> ScanInput:
    tiny = [5e-324, -5e-324, 1e-310, -1e-310, 2.2250738585072014e-308, -1e-200, 0.0, -0.0]
    rng = np.random.default_rng(5)
    scans = []
    for _ in range(20):
        origin = rng.choice(tiny, 3)
        ends = np.where(rng.random((12, 3)) < 0.5, rng.choice(tiny, (12, 3)), rng.integers(-4, 5, (12, 3)))
        scans.append(Scan(origin, ends, np.where(rng.random((4, 3)) < 0.5, rng.choice(tiny, (4, 3)), 3.0)))
    # The contract's only rounding besides the division: below 2^-200 voxels a coordinate is 2^-200.
    assert all(np.isfinite(to_voxel_units(scan.points, 1.0)).all() for scan in scans)
    return ScanInput(scans, 1.0)


def _posed(offset_m: float) -> Outcome:
    """Points of the sensor frame moved by a float64 pose: error in metres against extended precision."""
    rng = np.random.default_rng(7)
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rotation *= np.linalg.det(rotation)
    T_map_sensor = np.eye(4)
    T_map_sensor[:3, :3], T_map_sensor[:3, 3] = rotation, (offset_m, -offset_m, offset_m / 7)
    points = rng.uniform(-100, 100, (4000, 3)).astype(np.float32)
    columns = points.astype(np.float64).T
    moved = np.stack(
        [
            rotation[i, 0] * columns[0] + rotation[i, 1] * columns[1] + rotation[i, 2] * columns[2] + T_map_sensor[i, 3]
            for i in range(3)
        ],
        axis=1,
    )
    exact = points.astype(np.longdouble) @ rotation.T.astype(np.longdouble) + T_map_sensor[:3, 3]
    resolution_m, wrong = max(1.0, offset_m * 2.0**-19), 0
    posed, given = (rayvox.OccupancyMap(resolution_m, depth=21) for _ in range(2))
    posed.insert_scan(points, T_map_sensor)
    given.insert_scan(moved, origin=(offset_m, -offset_m, offset_m / 7))
    wrong += posed.to_bytes() != given.to_bytes()
    return Outcome(len(points), wrong, float(np.abs(moved - exact).max()))


def _posed_case(offset_m: float) -> Case:
    # Five roundings at most, each of half a unit in the last place of what is at most the sum of all terms.
    bound = 5 * 2.0**-53 * (offset_m + 100 * np.sqrt(3))
    must = "the map is that of the points moved in float64, and those are within the bound of the exact ones"
    return Case("translation", f"pose {offset_m:g} m out", must, lambda: _posed(offset_m), bound, "m")


def cases() -> list[Case]:
    """All that is about rays and the octree's places."""
    moves = [(1e3, 0.05, 16), (5e4, 0.05, 21), (1e6, 1.0, 21), (1e6, 100.0, 16), (1e7, 10.0, 21)]
    found = [
        scan_case("translation", f"{at:g} m, {res:g} m voxels, depth {d}", lambda a=at, r=res, d=d: _moved(a, r, d))
        for at, res, d in moves
    ]
    found += [_posed_case(offset_m) for offset_m in (1e3, 1e6, 1e7)]
    resolutions = (1e-4, 1e-3, 0.01, 0.05, 0.3, 1.0, 10.0, 100.0)
    found += [scan_case("resolution", f"{r:g} m", lambda r=r: _of_resolution(r)) for r in resolutions]
    for depth in range(4, 22):
        found.append(scan_case("depth", f"{depth} levels, up to the border", lambda d=depth: _at_the_border(d)))
    refused = "OutOfRangeError, and the map is unchanged"
    found += [
        Case("depth", f"{d} levels, beyond the border", refused, lambda d=d: _beyond_the_border(d)) for d in (4, 16, 21)
    ]
    found += [scan_case("ray length", f"{n:,} voxels", lambda n=n: _of_length(n)) for n in (0, 1, 100_000)]
    for offset in ("0", "1 ulp", "1e-12"):
        for r in (1.0, 0.05):
            name = f"{offset} off cell faces, {r:g} m voxels"
            found.append(scan_case("axis-parallel and grazing rays", name, lambda o=offset, r=r: _on_faces(o, r)))
    found.append(scan_case("denormals", "coordinates down to 5e-324", _denormal))
    return found
