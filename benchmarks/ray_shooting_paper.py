"""Table I and Figures 4 and 5 of Min, Han, Kim 2021 on six views of the simulated building.

    python -m benchmarks.ray_shooting_paper [--passes 12] [--repeats 3] [--out FOLDER] [--write NAME]

Six views of 320 x 240 rays, each shot into an octree of its own, at 13 cm, or 12 where that gives less than 22 thousand
free, occupied or unknown leaves (the paper's views have 22 to 35 thousand). OctoMap's columns are its C++ library's
(computeUpdate, and the rest of insertPointCloud)
and pyoctomap's; ours, per engine, for the first scan and for the last of PASSES insertions of the same scan: build BVH,
ray shooting (cutting rays included), hand-over (what lies between the stages), octree update.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import rayvox
from numpy.typing import NDArray
from rayvox import simulation

from benchmarks.peers.octomap_cpp import DriverUnavailableError, run_driver
from benchmarks.ray_shooting_figures import draw_hit_counts, draw_times
from benchmarks.report import REPOSITORY, print_table, provenance, write_results
from benchmarks.workloads import Workload, depth_views
from tests.support.octomap_peer import OctomapPeer

STAGES = ("build_bvh_ms", "ray_shooting_ms", "hand_over_ms", "octree_update_ms")
Stages = dict[str, float]
FEWEST_LEAVES = 22_000
RESOLUTIONS_M = (0.13, 0.12)


@dataclass(frozen=True)
class View:
    """One column of Table I."""

    name: str
    capture: simulation.DepthCapture
    workload: Workload  # this view alone


def make_views() -> list[View]:
    """The six views, a to f."""
    wholes, views = [depth_views(resolution_m) for resolution_m in RESOLUTIONS_M], []
    for index, (name, capture) in enumerate(simulation.benchmark_views().items()):
        for whole in wholes:
            workload = replace(whole, name=name, scans=(whole.scans[index],))
            if count_leaves(workload) >= FEWEST_LEAVES:
                break
        views.append(View(f"({'abcdef'[index]}) {name}", capture, workload))
    return views


def insert_once(occupancy_map: rayvox.OccupancyMap, workload: Workload, engine: rayvox.Engine) -> Stages:
    """Inserts the view and says how long each stage took, milliseconds."""
    scan = workload.scans[0]
    done = occupancy_map.insert_scan(
        scan.ends, origin=tuple(scan.origin.tolist()), max_range_m=workload.max_range_m, engine=engine
    ).statistics
    stages = {
        "build_bvh_ms": done.bvh_s,
        "ray_shooting_ms": done.cut_s + done.shoot_s,
        "octree_update_ms": done.update_s,
    }
    stages["hand_over_ms"] = max(done.total_s - sum(stages.values()), 0.0)
    return {name: 1e3 * seconds for name, seconds in stages.items()}


def shoot(workload: Workload, engine: rayvox.Engine, passes: int, repeats: int) -> dict[str, Stages]:
    """Medians for the first scan and the last of PASSES."""
    first, steady = [], []
    for _ in range(repeats):
        occupancy_map = rayvox.OccupancyMap(workload.resolution_m)
        runs = [insert_once(occupancy_map, workload, engine) for _ in range(passes)]
        first.append(runs[0])
        steady.append(runs[-1])
    return {
        kind: {stage: median(run[stage] for run in runs) for stage in STAGES}
        for kind, runs in (("first", first), ("steady", steady))
    }


def count_leaves(workload: Workload) -> int:
    """Free, occupied and unknown leaves of the view's octree: unknown is every child slot that holds nothing."""
    occupancy_map = rayvox.OccupancyMap(workload.resolution_m)
    insert_once(occupancy_map, workload, "dda")
    statistics = occupancy_map.statistics()
    known = statistics.free_leaves + statistics.occupied_leaves
    inner = statistics.nodes - known
    return known + 8 * inner - (statistics.nodes - 1)


def time_octomap(workload: Workload, repeats: int) -> Stages:
    """OctoMap's C++ library and pyoctomap on the view's first scan: medians, the update's as what shooting leaves."""
    shooting, whole, pyoctomap = [], [], []
    scan = workload.scans[0]
    for _ in range(repeats):
        measured, _ = run_driver(workload, 1, openmp=False)
        shooting.append(1e3 * measured["key_sets_s"][0])
        whole.append(1e3 * measured["first_s"][0])
        peer = OctomapPeer(workload.resolution_m)
        start = time.perf_counter()
        peer.insert_scan(scan.ends.astype(np.float64), scan.origin, workload.max_range_m)
        pyoctomap.append(1e3 * (time.perf_counter() - start))
    return {
        "ray_shooting_ms": median(shooting),
        "octree_update_ms": max(median(whole) - median(shooting), 0.0),
        "pyoctomap_whole_ms": median(pyoctomap),
    }


def hit_counts(view: View) -> NDArray[np.int64]:
    """Voxels that each pixel's ray passes, (height, width); -1 where nothing was measured."""
    pose, r = view.capture.scan.T_map_sensor, view.workload.resolution_m
    ends = view.capture.scan.points.astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
    borders = np.abs(np.floor(ends / r) - np.floor(pose[:3, 3] / r)).sum(axis=1)
    counts = np.full(view.capture.depth_u16.shape, -1, np.int64)
    counts[view.capture.depth_u16 > 0] = borders.astype(np.int64) + 1
    return counts


def measure(view: View, passes: int, repeats: int) -> dict[str, Any]:
    """One column of Table I."""
    return {
        "view": view.name,
        "rays": len(view.workload.scans[0].ends),
        "resolution_cm": 100 * view.workload.resolution_m,
        "leaves": count_leaves(view.workload),
        "octomap": time_octomap(view.workload, repeats),
        "engines": {engine: shoot(view.workload, engine, passes, repeats) for engine in rayvox.ENGINES},
    }


def print_table_one(columns: list[dict[str, Any]]) -> None:
    """Table I, with the octree update that the paper left out."""
    rows: list[list[object]] = [
        ["resolution, cm", "", *[c["resolution_cm"] for c in columns]],
        ["free, occupied or unknown leaves", "", *[c["leaves"] for c in columns]],
    ]
    rows += [["OctoMap", stage, *[c["octomap"][stage] for c in columns]] for stage in columns[0]["octomap"]]
    for engine, kinds in columns[0]["engines"].items():
        rows += [
            [f"{engine}, {kind}", stage, *[c["engines"][engine][kind][stage] for c in columns]]
            for kind in kinds
            for stage in STAGES
        ]
    print_table(["", "stage", *[c["view"] for c in columns]], rows)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--passes", type=int, default=12)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--out", type=Path, default=REPOSITORY / "build" / "ray_shooting_paper")
    parser.add_argument("--write", metavar="NAME", help="write benchmarks/results/NAME.json")
    arguments = parser.parse_args()
    header = provenance()
    views = make_views()
    try:
        columns = [measure(view, arguments.passes, arguments.repeats) for view in views]
    except DriverUnavailableError as error:
        raise SystemExit(str(error)) from error
    print(header)
    print_table_one(columns)
    arguments.out.mkdir(parents=True, exist_ok=True)
    for view in views:
        draw_hit_counts(view.name, view.capture.depth_u16, hit_counts(view), arguments.out)
    print("figures:", draw_times(columns, arguments.out).parent)
    if arguments.write:
        print("written:", write_results(arguments.write, header, columns))


if __name__ == "__main__":
    main()
