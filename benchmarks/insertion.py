"""Scan insertion, points to updated octree: rayvox against OctoMap in one run.

    python -m benchmarks.insertion [--quick] [--scans N] [--passes N] [--octomap-passes N] [--repeats N]
                                   [--only TEXT] [--write NAME]

First scan: into an empty map. Steady state: the scans inserted PASSES times over into one map, the last half of the
passes. Medians over scans, passes and repeats; rayvox and OctoMap take turns. Both get the same float32 rays.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

import numpy as np
import rayvox
from rayvox.occupancy_map import ENGINES, Engine

from benchmarks.peers.octomap_cpp import DriverUnavailableError, run_driver
from benchmarks.report import print_table, provenance, write_results
from benchmarks.workloads import RayScan, Workload, standard_workloads
from tests.support.leaf_comparison import compare_leaves
from tests.support.occupancy_oracle import Leaves
from tests.support.octomap_peer import OctomapPeer
from tests.support.rayvox_maps import leaves_of

Samples = dict[str, list[float]]


@dataclass(frozen=True)
class Contender:
    """One way of rayvox to insert; `threads` None: all cores."""

    engine: Engine = "auto"
    threads: int | None = None
    discretize: bool = False

    def insert(self, occupancy_map: rayvox.OccupancyMap, scan: RayScan, workload: Workload) -> float:
        """Seconds that one insertion takes, call included."""
        origin = tuple(scan.origin.tolist())
        start = time.perf_counter()
        occupancy_map.insert_scan(
            scan.ends,
            origin=origin,
            max_range_m=workload.max_range_m,
            engine=self.engine,
            discretize=self.discretize,
        )
        return time.perf_counter() - start


def contenders() -> dict[str, Contender]:
    """By the name in the table; plain "rayvox" is what a user gets."""
    engines = [engine for engine in ENGINES if engine != "auto"]
    return {
        "rayvox": Contender(),
        "rayvox, 1 thread": Contender(threads=1),
        **{f"rayvox, {engine}": Contender(engine) for engine in engines},
        "rayvox, discretize": Contender(discretize=True),
    }


def time_rayvox(workload: Workload, passes: int, contender: Contender, cores: int) -> tuple[Samples, Leaves]:
    """First-scan and steady-state seconds, and the leaves after one pass."""
    rayvox.set_thread_count(contender.threads or cores)
    # A process's very first insertions also get its memory; a service or a robot has that behind it.
    for scan in workload.scans:
        contender.insert(rayvox.OccupancyMap(workload.resolution_m), scan, workload)
    first = [contender.insert(rayvox.OccupancyMap(workload.resolution_m), scan, workload) for scan in workload.scans]
    occupancy_map, seconds, leaves = rayvox.OccupancyMap(workload.resolution_m), [], None
    for _ in range(passes):
        seconds += [contender.insert(occupancy_map, scan, workload) for scan in workload.scans]
        leaves = leaves or leaves_of(occupancy_map)
    rayvox.set_thread_count(cores)
    assert leaves is not None
    return {"first": first, "steady": seconds[len(seconds) // 2 :]}, leaves


def time_octomap(workload: Workload, passes: int, openmp: bool) -> tuple[Samples, Leaves]:
    """The same from OctoMap's C++ library, and its ray shooting alone."""
    measured, leaves = run_driver(workload, passes, openmp=openmp, leaves=True)
    assert leaves is not None
    steady = measured["pass_s"][len(measured["pass_s"]) // 2 :]
    samples = {"first": measured["first_s"], "steady": steady}
    return samples | {"ray_keys": measured["ray_keys_s"], "key_sets": measured["key_sets_s"]}, leaves


def time_pyoctomap(workload: Workload) -> float:
    """Seconds of one first-scan insertion through OctoMap's Python binding."""
    scan, peer = workload.scans[0], OctomapPeer(workload.resolution_m)
    ends = scan.ends.astype(np.float64)
    start = time.perf_counter()
    peer.insert_scan(ends, scan.origin, workload.max_range_m)
    return time.perf_counter() - start


def measure(workload: Workload, passes: int, repeats: int, octomap_passes: int) -> dict[str, Any]:
    """Every contender's medians in milliseconds on one workload."""
    cores = rayvox.thread_count()
    samples: dict[str, Samples] = {}
    leaves: dict[str, Leaves] = {}
    for _ in range(repeats):
        for name, contender in contenders().items():
            found, leaves[name] = time_rayvox(workload, passes, contender, cores)
            _extend(samples.setdefault(name, {}), found)
        for name, openmp in (("OctoMap", False), ("OctoMap, OpenMP", True)):
            found, leaves[name] = time_octomap(workload, octomap_passes, openmp)
            _extend(samples.setdefault(name, {}), found)
    times = {name: {kind: 1e3 * median(values) for kind, values in kinds.items()} for name, kinds in samples.items()}
    difference = compare_leaves(leaves["rayvox"], leaves["OctoMap"])
    octomap = {kind: min(times["OctoMap"][kind], times["OctoMap, OpenMP"][kind]) for kind in ("first", "steady")}
    ratios = {kind: octomap[kind] / times["rayvox"][kind] for kind in octomap}
    return {
        "workload": workload.name,
        "rays": workload.ray_count,
        "scans": len(workload.scans),
        "median_ms": times,
        "pyoctomap_first_ms": 1e3 * time_pyoctomap(workload),
        "ratio": ratios,
        "ratio_discretize": {kind: octomap[kind] / times["rayvox, discretize"][kind] for kind in octomap},
        "discretize_jaccard_free": _jaccard_of_free(leaves["rayvox"], leaves["rayvox, discretize"]),
        "leaves": len(leaves["rayvox"]),
        "voxels_differing": len(difference.cells),
    }


def _jaccard_of_free(plain: Leaves, discretized: Leaves) -> float:
    """How far the free voxels of two maps overlap: common ones over all."""
    free = [cells[log_odds < 0] for cells, log_odds in (plain.expanded(), discretized.expanded())]
    common = len(np.intersect1d(*free, assume_unique=True))
    return common / max(1, len(free[0]) + len(free[1]) - common)


def _extend(samples: Samples, more: Samples) -> None:
    for kind, values in more.items():
        samples.setdefault(kind, []).extend(values)


def print_results(results: list[dict[str, Any]]) -> None:
    """One row per workload and contender."""
    rows = []
    for result in results:
        for name, times in result["median_ms"].items():
            shooting = times.get("ray_keys", "")
            rows.append([result["workload"], name, times["first"], times["steady"], shooting])
        rows.append([result["workload"], "pyoctomap", result["pyoctomap_first_ms"], "", ""])
        for title, key in (("OctoMap / rayvox", "ratio"), ("OctoMap / rayvox, discretize", "ratio_discretize")):
            rows.append([result["workload"], title, result[key]["first"], result[key]["steady"], ""])
    print_table(["workload", "contender", "first scan ms", "steady ms", "ray keys alone ms"], rows)
    for result in results:
        print(
            f"{result['workload']}: {result['leaves']} leaves, {result['voxels_differing']} voxels differ (ties); "
            f"discretize's free space overlaps by a Jaccard index of {result['discretize_jaccard_free']:.3f}"
        )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description="Scan insertion: rayvox against OctoMap.")
    parser.add_argument("--quick", action="store_true", help="two scans of each workload, one repeat, few passes")
    # OctoMap takes half a minute an outdoor sweep: `--only outdoor --scans 1 --octomap-passes 2` bounds it.
    parser.add_argument("--scans", type=int, help="only the first N scans of each workload, for every contender")
    parser.add_argument("--passes", type=int, default=20)
    # Five misses saturate a voxel, so OctoMap's sixth pass is its steady state; twenty would take an hour.
    parser.add_argument("--octomap-passes", type=int, default=6)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", default="", help="workloads whose name contains this")
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    passes, repeats, octomap_passes = arguments.passes, arguments.repeats, arguments.octomap_passes
    header = provenance()
    workloads = [replace(w, scans=w.scans[: arguments.scans]) for w in standard_workloads() if arguments.only in w.name]
    if arguments.quick:
        passes, repeats = 12, 1
        workloads = [replace(w, scans=w.scans[:2]) for w in workloads]
    try:
        results = [measure(w, passes, repeats, octomap_passes) for w in workloads]
    except DriverUnavailableError as error:
        raise SystemExit(str(error)) from error
    print(header)
    print_results(results)
    if arguments.write:
        print("written:", write_results(arguments.write, header, results))


if __name__ == "__main__":
    main()
